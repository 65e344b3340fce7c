"""From a film of a face to a capture: landmarks, a head model fitted to them and to the pictures, masks."""
