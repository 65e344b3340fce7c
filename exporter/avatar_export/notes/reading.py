"""What readers and rigs say of the files that they read."""

from __future__ import annotations

from collections.abc import Sequence

from avatar_export.notes.note import Setting
from avatar_export.notes.words import units

UNSTATED = "assumed, nothing says otherwise"
SETTINGS = {  # of a training, besides `units`; rules have their own names
    "scale": "mesh scaling {value}",
    "sh_direction": "SH direction {value}",
    "sh_degree": "SH degree {value}",
    "background": "{value} background",
}

TEXTS = {
    "unchecked": "unchecked: this reader follows the released code, but was never tried on a released file",
    "settings": "{settings:settings}",
    "recorded_rules": "{file} records how it was trained: {rules:each}",
    "taken": "{what} is read{others:over}",
    "rate_assumed": "{file} does not say its rate; {fps:g} frames a second are taken",
    "mean_identity": "no identity ({options:listed}): the body model's mean shape is taken",
    "identity_differs": "the identity of {file} is another than that of --shape {given}, which is taken",
    "no_mesh_eyelids": "no eyelid files (--eyelids): the Gaussians' lids close, those of the rig's mesh do not",
    "weights_renormalised": "skin weights of {count} vertices did not add up to 1; divided by their sum",
    # rigs
    "no_rig_given": "no rig: give one by --rig FILE.glb|.fbx or --body-model; without it there is no rig.glb, rig.usdc "
    "holds splats alone, and the avatar plays on posed vertices, Player.frame(posed_vertices=...) or render --meshes",
    "vertices_found": "vertices of {file} found by {how}",
    "vertices_repeated": "{count} vertices stand in {file} several times with different weights or morphs; the first "
    "is taken",
    "asm_neutral": "an ASM face: the rig rests in its neutral",
    "nodes_off_binding": "the nodes of {file} do not stand in binding pose (largest entry {deviation:.3g}); rest "
    "transforms are those of the inverse bind matrices",
    "meshes_joined": "{meshes:many} meshes of {file} joined: {meshes:some}",
    "polygons_cut": "{count} polygons of {file} cut into fans of triangles from their first corner",
    "between_left_out": "{count} in-between shapes left out: a blend shape moves straight to its last one",
    "dual_quaternions": "a mesh is skinned by dual quaternions in the file, here linearly: twisted joints look thinner",
    # embedded Gaussians
    "outside_triangles": "{count} Gaussians lie up to {far:.2g} outside their triangle; kept so",
    "no_own_rotation": "no _rotation in {file}: rot_* of {cloud} is taken",
    "numbers_unused": "_xyz of {count} Gaussians has first numbers that are not 0; the release uses the third alone",
    "other_positions": "x y z of {cloud} lie {apart:length} (median) from the embedding: another frame's, or not its "
    "mesh",
    "without_skeleton": "without a rig rotations are those of the posed mesh ({rule}), not of the skeleton as trained, "
    "and what the mesh learned is left to whoever poses it",
    "bases_in_rig": "{count} learned basis vectors are in the rig's morphs and correctives",
    # LHM and RGBAvatar
    "no_sampled_points": "no {pattern}: each Gaussian takes the weights of the vertex that is nearest to itself, not "
    "to its sampled point; {how}",
    "linear_network": "weight_module is linear: FLAME's expressions drive the bases; joints drive only their "
    "positions, and the head's translation drives nothing",
    "hidden_layers": "weight_module is a network with hidden layers, which no player runs: its {count} bases are "
    "expressions of their own ({first} ...), 0 where FLAME rests; the clip of --poses has their weights; for an avatar "
    "that FLAME's expressions drive alone, dump posed frames and run `avatar-export distill`",
    "no_tangent_frames": "a bundle has no tangent frames: in {poses} random poses (expressions of deviation "
    "{deviation:g}, joints within 15 degrees, the jaw open by up to 20) Gaussians lie {rms:length} (rms; {far:length} "
    "at most) from where the released formulas put them, are turned by {degrees:.2g} degrees (rms) and differ by "
    "{colour:.2g} in colour (rms, of 1)",
    # ASM
    "asm_binding": "{count} Gaussians a bone, weights by rule {rule}",
    "weights_dropped": "skin weights below {least:g} dropped: {joints:.1f} joints a vertex are left, and the neutral "
    "lies within {mm:.2g} mm of the formulas",
    "scales_rounded": "scales of takes rounded to half floats, all that UsdSkel holds: they lie within {mm:.2g} mm of "
    "the formulas",
}


def setting(one: Setting) -> str:
    """A setting, without its source."""
    if one.name == "units":
        return units(float(one.value))
    return SETTINGS.get(one.name, "{name} {value}").format(name=one.name, value=one.value)


def settings(given: Sequence[Setting]) -> str:
    """Settings with their sources."""
    return "; ".join(f"{setting(one)} ({one.source or UNSTATED})" for one in given)
