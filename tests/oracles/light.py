"""The stage ``light`` once more, in float64 and one Gaussian at a time, written from SPEC.md section 19
alone: it shares no code with the runtime."""

import math

FLOOR = 0.05
NEAREST = 1e-4  # m^2


def basis(n):
    """Nine real spherical harmonics of a unit vector, with the signs of 3D Gaussian Splatting."""
    x, y, z = n
    root = math.sqrt
    pi = math.pi
    return [
        root(1 / (4 * pi)),
        -root(3 / (4 * pi)) * y,
        root(3 / (4 * pi)) * z,
        -root(3 / (4 * pi)) * x,
        root(15 / (4 * pi)) * x * y,
        -root(15 / (4 * pi)) * y * z,
        root(5 / (16 * pi)) * (3 * z * z - 1),
        -root(15 / (4 * pi)) * x * z,
        root(15 / (16 * pi)) * (x * x - y * y),
    ]


def irradiance(rows, n):
    weights = basis(n)
    return [
        sum(weight * row[channel] for weight, row in zip(weights, rows, strict=True)) for channel in range(3)
    ]


def turn(quat, v):
    """``v`` turned by a quaternion w, x, y, z of any length (v' = v + 2w(q x v) + 2 q x (q x v))."""
    length = math.sqrt(sum(part * part for part in quat))
    w, x, y, z = (part / length for part in quat)
    cx, cy, cz = y * v[2] - z * v[1], z * v[0] - x * v[2], x * v[1] - y * v[0]
    return [
        v[0] + 2 * (w * cx + y * cz - z * cy),
        v[1] + 2 * (w * cy + z * cx - x * cz),
        v[2] + 2 * (w * cz + x * cy - y * cx),
    ]


def turned_by_triangle(posed, canonical, quat, normal, world):
    """The normal of a Gaussian on a triangle, from its axes to the world: section 19, rule bary_vertex_lbs.

    An edge and the normal of a triangle fix its turn, whichever axes are laid through them.
    """

    def axes(a, b, c):
        edge = unit([q - p for p, q in zip(a, b, strict=True)])
        other = [q - p for p, q in zip(a, c, strict=True)]
        up = unit(cross(edge, other))
        return edge, up, cross(up, edge)

    bound = turn(quat, normal)
    along = [sum(p * q for p, q in zip(axis, bound, strict=True)) for axis in axes(*canonical)]
    moved = [sum(k * axis[i] for k, axis in zip(along, axes(*posed), strict=True)) for i in range(3)]
    return [sum(row[i] * moved[i] for i in range(3)) for row in world]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(v):
    length = math.sqrt(sum(part * part for part in v))
    return [part / length for part in v]


def scene(position, n, ambient, lights, visible=1.0):
    """Light that falls on a surface: ``lights`` are ("direction" | "position", xyz, rgb); ``visible`` is of
    the first one."""
    total = irradiance(ambient, n)
    for index, (kind, place, colour) in enumerate(lights):
        towards = place if kind == "direction" else [a - b for a, b in zip(place, position, strict=True)]
        square = sum(part * part for part in towards)
        falloff = 1.0 if kind == "direction" else 1 / max(square, NEAREST)
        facing = max(sum(a * b for a, b in zip(unit(towards), n, strict=True)), 0.0)
        seen = visible if index == 0 else 1.0
        total = [t + c * facing * falloff * seen for t, c in zip(total, colour, strict=True)]
    return [max(t, 0.0) for t in total]


def relit(colour, ratio):
    """A display colour after its light changed by ``ratio``."""
    if all(part == 1.0 for part in ratio):
        return list(colour)
    out = []
    for c, r in zip(colour, ratio, strict=True):
        if c > 0.04045:
            p = (c + 0.055) * r ** (1 / 2.4)
            out.append(p - 0.055 if p > 0.09545 else 12.92 * (p / 1.055) ** 2.4)
        else:
            linear = c / 12.92 * r
            out.append(12.92 * linear if linear <= 0.0031308 else 1.055 * linear ** (1 / 2.4) - 0.055)
    return out


def light(colour, position, quat, normal, ambient, lights, captured, world_from_capture=None, visible=1.0):
    """One Gaussian's display colour under a light; ``world_from_capture`` [3][3] turns the capture's frame."""
    n = unit(turn(quat, normal))
    turned = world_from_capture or [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    n_capture = [sum(turned[row][axis] * n[row] for row in range(3)) for axis in range(3)]
    here = scene(position, n, ambient, lights, visible)
    there = irradiance(captured, n_capture)
    return relit(colour, [a / max(b, FLOOR) for a, b in zip(here, there, strict=True)])
