"""What distilling says of dumps and of the avatar that it learnt from them."""

from __future__ import annotations

from collections.abc import Callable, Mapping


def _distilled(held_out: bool, **_: object) -> str:
    if held_out:
        return "distilled from posed dumps: {frames} held-out frames, {mm:.3g} mm RMS, {db:.1f} dB in the foreground"
    return "distilled from posed dumps: baked clips, not held out: {mm:.3g} mm RMS and {db:.1f} dB in the foreground"


def _form(why: str | None, dropped: str | None, **_: object) -> str:
    text = "{form} has the least error on held-out frames ({tried})"
    if why is not None:
        text = "{why}, so {form} was learnt ({tried})"
    return text if dropped is None else f"{text}; of it, entries that show least were dropped ({{dropped}})"


def _untaught(by_rig: bool, **_: object) -> str:
    text = "never moved against their parents in the dumps: {joints:some} ({joints:many} of the joints); "
    if by_rig:
        return text + "the mesh alone says what they carry"
    return text + "nothing was learnt of them, and they move nothing: dump poses in which they turn"


def _not_human(then: float | None, **_: object) -> str:
    text = "the figure is {size:length} large at unit {unit:g} of {file}, as no human head or body is"
    return f"{text}: at unit {{right:.4g}} it would be {{then:length}}" if then is not None else text


def _shifted(shift: int, **_: object) -> str:
    way = "later" if shift > 0 else "earlier"
    return (
        f"{{which}} of {{takes:listed}} seem to be {abs(shift)} frames off: rows of drivers.npz that stand "
        f"{abs(shift)} {way} predict the Gaussians {{times:.3g}} times better; move them"
    )


TEXTS: Mapping[str, str | Callable[..., str]] = {
    "distilled": _distilled,
    "form": _form,
    "no_skeleton": "drivers.npz has no skeleton: the result plays the dumped takes, and nothing else",
    "still_driver": "driver {driver} hardly varies{more}: nothing was learnt of it; dump each driver alone",
    "one_camera": "colours were dumped for one camera: from elsewhere they are approximate",
    "few_frames": "there are {frames} frames to learn from, fewer than twice the {drivers} drivers: dump more, half "
    "of them random poses",
    "one_take": "there is one take, so the held-out frames are one block of neighbours of those learnt from: their "
    "error says little about other poses; dump a second take",
    "foreground_off": "the foreground of held-out frames reaches {db:.1f} dB, less than {least:g}",
    "positions_off": "positions of held-out frames are {mm:.3g} mm off, {share:.2g} % of the figure's height, more "
    "than {most:g} %",
    "untaught": _untaught,
    "not_human": _not_human,
    "shifted": _shifted,
    "quaternion_doubt": "rot_0..3 may be {right}, not {stated}: surface and turns of the Gaussians do not agree; look "
    "at encoding.quaternion",
    # judged
    "fit": "the dumps are fit for distill",
    "fit_mended": "the dumps are fit for distill, as mended",
    "fit_doubtful": "the dumps can be distilled, but see to the warnings first",
    "unfit": "the dumps are not fit for distill",
    # mended
    "mended": "mended: {what:note}",
    "order_changes": "the order of the Gaussians changes in {frames}; they were matched by colour, opacity and scale",
    "signs_change": "quaternions change their sign in {frames}; signs were aligned",
    "covariances": "{file} holds {property}..5 and no scales: encoding.scale is covariance",
    "scale_encoding": "scale_0..2 of {file} are {median:.3g} in the middle: they are of encoding {right}, not {stated}",
    "linear_opacity": "opacity of {file} lies in 0..1 everywhere: it is linear, not a logit",
    "logit_opacity": "opacity of {file} lies outside of 0..1: it is a logit, not linear",
    "quaternion_order": "rot_0..3 turn with the places as {right}, not as {stated}: encoding.quaternion is {right}",
    "unrotated_sh": "f_rest_* do not turn with the joints, though dumps.json says rotated: they are read as unrotated, "
    "so the avatar turns the view direction",
}
