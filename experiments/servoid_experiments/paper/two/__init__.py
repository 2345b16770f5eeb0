"""The object of two ellipsoids of Section 5.2, Fig. 9: it is modelled with three."""
