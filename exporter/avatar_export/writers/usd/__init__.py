"""The avatar as a USD stage, rig.usdc. Only this room imports pxr; its modules are imported when needed."""
