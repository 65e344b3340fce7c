"""Differentiable rasterisers of the `trainer` profile; `raster.renderer.render` chooses one."""
