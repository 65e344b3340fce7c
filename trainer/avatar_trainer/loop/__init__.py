"""The training loop: iterations, checkpoints, resuming, progress and logs."""
