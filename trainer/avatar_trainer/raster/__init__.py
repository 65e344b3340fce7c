"""Differentiable rasterisers of the `trainer` profile; `renderer.render` chooses one."""
