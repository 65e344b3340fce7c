"""What several systems share: first points on a mesh, and rigid placement."""
