//! Any triangles, closed or not.

use nalgebra::Vector3;
use servoid::shape::{Mesh, ShapeError, Soup};

use super::draw::Draw;

pub fn any(draw: &mut Draw) -> Result<(), String> {
    let corners = draw.pick(&[0, 3, 4, 8, 30]);
    let spread = draw.pick(&[1e-9, 1.0, 1.0, 1.0, 1e6]);
    let vertices: Vec<[f64; 3]> = (0..corners)
        .map(|_| {
            let fair = [(); 3].map(|()| spread * draw.within(-1.0, 1.0));
            if draw.chance(0.02) { draw.numbers() } else { fair }
        })
        .collect();
    let last = corners + usize::from(draw.chance(0.1));
    let faces: Vec<[usize; 3]> = (0..draw.pick(&[0, 1, 4, 20, 60]))
        .filter(|_| last > 0)
        .map(|_| [(); 3].map(|()| draw.below(last)))
        .collect();
    let _ = Mesh::new(vertices.clone(), faces.clone());
    let Ok(soup) = Soup::new(&vertices, &faces) else { return Ok(()) };
    if vertices.iter().flatten().any(|x| x.abs() > 1e9) {
        return Ok(());
    }
    let point = Vector3::from([(); 3].map(|()| spread * draw.within(-1.0, 1.0)));
    let (around, most) = (soup.winding(&point), faces.len() as f64);
    if around.is_nan() || around.abs() > most {
        return Err(format!("{most} triangles wind {around} times around {point:?}"));
    }
    let open = soup.openness(&faces).map_err(|e| e.to_string())?;
    if open.is_nan() || open.abs() > 1.0 + 1e-9 {
        return Err(format!("fronts see {open} more than backs"));
    }
    let built = soup.rebuilt(draw.pick(&[0, 2, 8, 12])).map_err(|e| e.to_string())?;
    let Some(built) = built else { return Ok(()) };
    match Mesh::new(built.vertices, built.faces) {
        Ok(_) | Err(ShapeError::Volume(_)) => Ok(()),
        Err(fault) => Err(format!("what was built anew: {fault}")),
    }
}
