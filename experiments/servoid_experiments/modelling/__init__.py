"""The study of modelling: the quality of a body by its inputs."""
