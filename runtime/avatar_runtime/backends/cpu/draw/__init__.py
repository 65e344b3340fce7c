"""Drawing on the CPU: stages project, sort and raster in tiles of pixels."""
