"""Templates: a head mesh with bones, a plane of mixtures and first weights."""
