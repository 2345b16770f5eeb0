"""Solids, paint and a stage: what scenes of samples are made of."""
