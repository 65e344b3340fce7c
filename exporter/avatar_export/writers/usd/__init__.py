"""The avatar as a USD stage, rig.usdc. The only place that imports pxr; its modules are imported when needed."""
