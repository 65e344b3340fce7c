"""Motion of a face as it is captured: frames from the network, recordings of them, and how late they are shown."""
