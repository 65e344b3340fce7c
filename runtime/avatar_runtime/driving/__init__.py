"""From the 52 ARKit names and captured rotations of head and eyes to poses of an avatar. SPEC.md, section 8."""
