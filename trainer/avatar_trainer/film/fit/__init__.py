"""The fit of the head model to a film: landmarks, the skin's look, the outline; then every frame, gaze, smoothing."""
