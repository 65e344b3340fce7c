"""Makes the table by which a page reads a visitor's face: MediaPipe's findings -> weights, learnt on drawn people."""
