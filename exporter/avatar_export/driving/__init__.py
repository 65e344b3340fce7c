"""From recordings of a face (ARKit names, Live Link Face) to poses of an avatar."""
