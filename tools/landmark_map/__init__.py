"""Makes `landmark_map.npz`: where MediaPipe's landmarks lie on the head model, measured on heads drawn at random."""
