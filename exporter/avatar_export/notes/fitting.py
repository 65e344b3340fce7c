"""How inputs from different files fit: see docs/misfits.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping


def _rig_off(tracked: bool, **_: object) -> str:
    text = "{own} lies {median:length} (median; {far:length} at most) from {goal} {when}, {share:percent} its size"
    look = "look whether the identity (--shape), the poses and the rig are those of the training"
    return f"{text}, although its tracked poses are given; {look}" if tracked else f"{text}{{cause:also}}"


def _group_off(others: str | None, **_: object) -> str:
    text = "{own} of {group} lie {median:length} (median) from the mesh of {goal}, {share:percent} its size"
    beside = "; {others} lies {near:length} from it: look at the files of {group}"
    return f"{text}{beside if others else ''}{{cause:also}}"


def _moves(gain: float, **_: object) -> str:
    far = "" if gain == 1 else ", {gain:.2g} times as far"
    text = "{what} do not move {own} as they move {goal} under them: correlation {correlation:.2f}"
    return f"{text}{far}{{cause:also}}"


def _other_identity(name: str | None, **_: object) -> str:
    if name is not None:
        return "it would be {median:length} with {name} in place of {given}"
    return (
        "it would be {median:length} with another identity of this body model ({first}, ...) than {given}: pass the "
        "subject's own --shape"
    )


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "rig_fits": "the rig {when} is the mesh to within {far:.3f} mm (rms {rms:.3f} mm)",
    "rig_off": _rig_off,
    "rig_unproved": "the mesh is not the rig {tried}, and no tracked poses (--poses) show that the rig fits it",
    "gaussians_off": "{own} lie {median:length} (median) from {goal}, {share:percent} its size{cause:also}",
    "group_off": _group_off,
    "distances": "median distance from the mesh of {goal}: {groups:lengths}",
    "moves_otherwise": _moves,
    "moves_like_others": "expressions move as others of {goal} do: {order:and}",
    "weights_elsewhere": "{share:.0%} of the skin weights of {own} go to other joints than those of {goal} under them",
    "anchors_on_jaw": "the anchor faces hang on the jaw ({share:.0%}), and the upper teeth on them: look at "
    "--anchor-faces",
    "few_coefficients": "the identity ({given}) has {count} of the body model's {known} coefficients: pass the whole "
    "identity",
    "not_human_if_metres": "the mesh is {height:.3g} m high if {file} is in metres",
    "not_human_at_units": "the mesh is {height:.3g} m high at {units:units}; --units sets another number",
    "joint_outside": "joint {joint} rests {far:.3g} m outside the mesh that it moves",
    "joints_exchanged": "joint {left} rests on the right of {right}: the mesh is mirrored or turned round",
    # causes
    "mend": "it would be {left:length} {steps:and}",
    "with_option": "with {option} {value:.6g}",
    "if_larger": "if {own} were {times:.4g} times larger",
    "if_metres": "if {goal} were in metres: its lengths seem to be {unit}; divide them by {times:.4g}",
    "if_turned": "if x, y, z of {goal} were turned, which are {axes} of {own} (+Y is up, the face looks along +Z)",
    "if_moved": "if {goal} were moved by ({by}) m",
    "other_pose": "a turn by {degrees:.0f} degrees and a shift would leave {left:length}: the mesh stands in another "
    "pose; pass the poses of the training (--poses)",
    "other_identity": _other_identity,
    "other_unit": "look at the unit of its expression directions",
    "other_body": "the body model is another one than that of the training",
    "other_order": "{own} of the checkpoint moves like {theirs} of the body model: their order differs",
    "eyelid_files": "look at --eyelids",
}
