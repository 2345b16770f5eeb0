// Renders ellipsoids by casting a ray through each pixel, in a view that the user can rotate.
"use strict";
(function () {
  const scene = JSON.parse(document.getElementById("scene").textContent);
  const canvas = document.getElementById("turntable");
  const gl = canvas.getContext("webgl2", { antialias: false });
  if (!gl) {
    document.getElementById("no-webgl").hidden = false;
    canvas.hidden = true;
    return;
  }

  const castVertex = `#version 300 es
    out vec2 place;
    void main() {
      place = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
      gl_Position = vec4(place, 0.0, 1.0);
    }`;
  // Five texels per ellipsoid: centre, rows of the matrix that maps it to the unit ball, colour.
  const castFragment = `#version 300 es
    precision highp float;
    const int COUNT = ${scene.ellipsoids.length};
    uniform highp sampler2D table;
    uniform vec3 eye, right, up, ahead, light, sky;
    uniform vec2 slope, range;
    in vec2 place;
    out vec4 color;
    vec3 cell(int column, int row) { return texelFetch(table, ivec2(column, row), 0).xyz; }
    mat3 toBall(int i) { return transpose(mat3(cell(1, i), cell(2, i), cell(3, i))); }
    void main() {
      vec3 ray = ahead + place.x * slope.x * right + place.y * slope.y * up;
      float nearest = range.y;
      int owner = -1;
      for (int i = 0; i < COUNT; ++i) {
        mat3 ball = toBall(i);
        vec3 start = ball * (eye - cell(0, i));
        vec3 along = ball * ray;
        float a = dot(along, along), b = dot(along, start);
        // Measured from the ray's point nearest to the centre, to avoid cancellation.
        vec3 foot = start - along * (b / a);
        float c = 1.0 - dot(foot, foot);
        if (c > 0.0) {
          float t = -b / a - sqrt(c / a);
          if (t > range.x && t < nearest) { nearest = t; owner = i; }
        }
      }
      if (owner < 0) discard;
      vec3 point = eye + nearest * ray;
      mat3 ball = toBall(owner);
      vec3 normal = normalize(transpose(ball) * (ball * (point - cell(0, owner))));
      vec3 toward = -normalize(ray);
      float rim = pow(1.0 - max(dot(normal, toward), 0.0), 3.0);
      float lit = 0.72 * max(dot(normal, light), 0.0) + 0.36 + 0.12 * dot(normal, sky);
      vec3 own = pow(cell(4, owner), vec3(2.2));
      vec3 radiance = own * lit + 0.16 * rim * (0.35 * own + 0.10);
      color = vec4(pow(clamp(1.12 * radiance, 0.0, 1.0), vec3(1.0 / 2.2)), 1.0);
      float depth = (range.y + range.x - 2.0 * range.x * range.y / nearest) / (range.y - range.x);
      gl_FragDepth = 0.5 * depth + 0.5;
    }`;
  const lineVertex = `#version 300 es
    uniform vec3 eye, right, up, ahead;
    uniform vec2 slope, range;
    layout(location = 0) in vec3 point;
    layout(location = 1) in vec3 ink;
    out vec3 shade;
    void main() {
      vec3 offset = point - eye;
      float depth = dot(offset, ahead);
      shade = ink;
      gl_Position = vec4(dot(offset, right) / slope.x, dot(offset, up) / slope.y,
        ((range.y + range.x) * depth - 2.0 * range.x * range.y) / (range.y - range.x), depth);
    }`;
  const lineFragment = `#version 300 es
    precision highp float;
    in vec3 shade;
    out vec4 color;
    void main() { color = vec4(shade, 1.0); }`;

  function program(vertex, fragment) {
    const linked = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) {
        throw new Error(gl.getShaderInfoLog(shader));
      }
      gl.attachShader(linked, shader);
    }
    gl.linkProgram(linked);
    return linked;
  }

  const caster = program(castVertex, castFragment);
  const liner = program(lineVertex, lineFragment);

  const cells = [];
  for (const { center, to_ball: rows, color } of scene.ellipsoids) {
    for (const cell of [center, ...rows, color.map((channel) => channel / 255)]) {
      cells.push(...cell, 0);
    }
  }
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 5, scene.ellipsoids.length, 0, gl.RGBA, gl.FLOAT,
    new Float32Array(cells));
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
  gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);

  const vertices = [];
  for (const { points, color } of scene.cameras) {
    for (const end of [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1]) {
      vertices.push(...points[end], ...color.map((channel) => channel / 255));
    }
  }
  const nothing = gl.createVertexArray();
  const lines = gl.createVertexArray();
  gl.bindVertexArray(lines);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(vertices), gl.STATIC_DRAW);
  for (const [location, offset] of [[0, 0], [1, 12]]) {
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 24, offset);
  }

  const combine = (...terms) => [0, 1, 2].map((i) =>
    terms.reduce((sum, [weight, vector]) => sum + weight * vector[i], 0));
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [0, 1, 2].map((i) => {
    const [j, k] = [(i + 1) % 3, (i + 2) % 3];
    return a[j] * b[k] - a[k] * b[j];
  });
  const unit = (a) => combine([1 / Math.hypot(...a), a]);

  const HALF_VIEW = Math.tan((14 * Math.PI) / 180);
  const view = { turn: scene.turn, rise: scene.rise, distance: 0 };

  function draw() {
    const ratio = Math.max(2, window.devicePixelRatio || 1);
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio));
    const height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    const level = Math.cos(view.rise);
    const away = combine([level * Math.cos(view.turn), scene.side],
      [level * Math.sin(view.turn), scene.front], [Math.sin(view.rise), scene.up]);
    const ahead = combine([-1, away]);
    const right = unit(cross(ahead, scene.up));
    const up = cross(right, ahead);
    const values = {
      eye: combine([view.distance, away]), right, up, ahead,
      light: unit(combine([0.8, scene.up], [0.6, up], [-0.5, right], [-0.6, ahead])),
      sky: scene.up,
      slope: [(HALF_VIEW * width) / Math.min(width, height),
        (HALF_VIEW * height) / Math.min(width, height)],
      range: [0.02 * view.distance, view.distance + 2 * scene.reach + 2],
    };
    gl.viewport(0, 0, width, height);
    gl.clearColor(0.965, 0.965, 0.957, 1);
    gl.enable(gl.DEPTH_TEST);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    use(caster, nothing, values);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    use(liner, lines, values);
    scene.cameras.forEach(({ points }, index) => {
      // From a viewpoint among the cameras, those in front of the body would hide it.
      const behind = dot(combine([1, points[0]], [-1, values.eye]), ahead) > view.distance;
      if (behind || view.distance > scene.reach) {
        gl.drawArrays(gl.LINES, 16 * index, 16);
      }
    });
    canvas.dataset.drawn = "yes";
  }

  function use(chosen, array, values) {
    gl.useProgram(chosen);
    gl.bindVertexArray(array);
    for (const [name, value] of Object.entries(values)) {
      gl["uniform" + value.length + "fv"](gl.getUniformLocation(chosen, name), value);
    }
  }

  let waiting = false;
  function refresh() {
    if (!waiting) {
      waiting = true;
      requestAnimationFrame(() => { waiting = false; draw(); });
    }
  }
  function turn(across, upward) {
    view.turn -= across;
    view.rise = Math.min(1.55, Math.max(-1.55, view.rise + upward));
    refresh();
  }
  function zoom(factor) {
    view.distance = Math.min(8 * (scene.reach + 1) / HALF_VIEW,
      Math.max(1.3, view.distance * factor));
    refresh();
  }
  function stepBack(radius) {
    view.distance = (1.3 * radius) / Math.sin(Math.atan(HALF_VIEW));
  }

  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons) {
      const size = Math.min(canvas.clientWidth, canvas.clientHeight);
      turn((3 * event.movementX) / size, (3 * event.movementY) / size);
    }
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    zoom(Math.exp(0.001 * event.deltaY));
  }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const moves = {
      ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0),
      ArrowUp: () => turn(0, -0.1), ArrowDown: () => turn(0, 0.1),
      "+": () => zoom(0.9), "-": () => zoom(1 / 0.9),
    };
    if (moves[event.key]) {
      event.preventDefault();
      moves[event.key]();
    }
  });
  document.getElementById("show-body").addEventListener("click", () => {
    stepBack(1);
    refresh();
  });
  document.getElementById("show-cameras").addEventListener("click", () => {
    stepBack(0.85 * scene.reach);
    refresh();
  });
  window.addEventListener("resize", refresh);
  stepBack(1);
  draw();
})();
