"""The paper's experiments, redone, with its findings beside ours."""
