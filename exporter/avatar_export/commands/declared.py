"""Commands of declared options: a function that takes dataclasses of options, as typer takes it."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from types import GenericAlias
from typing import Annotated, Any, get_args, get_type_hints

import typer

from avatar_export.options import Declared, Option, Options, declared, declared_as


def command(function: Callable[..., None]) -> Callable[..., None]:
    """`function` for typer: a parameter that is a dataclass of options becomes an option a field, and one annotated
    with an Option an option. Of two fields of one name the first counts, and the other keeps its default.

    What an option refuses becomes a usage error.
    """
    shown: dict[str, inspect.Parameter] = {}
    alone: dict[str, Declared] = {}
    groups: dict[str, tuple[type[Options], Mapping[str, Declared]]] = {}
    hints = get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        hint = hints[name]
        if isinstance(hint, type) and issubclass(hint, Options):
            own = {key: one for key, one in declared(hint).items() if key not in shown}
            groups[name] = hint, own
            shown |= {key: _parameter(one) for key, one in own.items()}
        elif any(isinstance(one, Option) for one in get_args(hint)):
            alone[name] = declared_as(name, hint, parameter.default)
            shown[name] = _parameter(alone[name])
        else:
            shown[name] = parameter.replace(annotation=hint, kind=inspect.Parameter.KEYWORD_ONLY)

    def called(**given: Any) -> None:
        values = {name: _value(one, given.pop(name)) for name, one in alone.items()}
        for name, (kind, own) in groups.items():
            values[name] = kind(**{key: _value(one, given.pop(key)) for key, one in own.items()})
        function(**given, **values)

    made: Any = called
    made.__name__, made.__doc__ = function.__name__, function.__doc__
    made.__signature__ = inspect.Signature([*shown.values()])  # that typer reads
    result: Callable[..., None] = made
    return result


def _parameter(one: Declared) -> inspect.Parameter:
    """The parameter that typer reads."""
    option, default = one.option, one.default
    kind: Any = one.kind
    flags = option.flags
    if option.text is not None:
        kind, default = str, option.shown
    elif option.off:
        default = False
    elif one.several:
        kind, default = GenericAlias(list, (one.kind,)), None
    elif kind is bool and not flags:
        flags = (one.flag,)
    said = typer.Option(*flags, help=option.help, min=option.least, max=option.most, metavar=option.metavar)
    hint: Any = kind | None if default is None else kind
    only = inspect.Parameter.KEYWORD_ONLY
    return inspect.Parameter(one.name, only, default=default, annotation=Annotated[hint, said])


def _value(one: Declared, given: Any) -> Any:
    """The option's value from typer's. Raises a usage error."""
    try:
        if one.option.off:
            return not given
        if one.option.text is not None:
            return one.default if given is None else one.option.text(given)
        return one.checked(given or () if one.several else given)
    except ValueError as error:
        raise typer.BadParameter(str(error).removeprefix(f"{one.name}: "), param_hint=one.flag) from None
