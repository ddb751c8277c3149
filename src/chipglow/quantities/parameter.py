"""The declaration of a setting: what it means, its unit and its limits, in one place."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import cycle
from math import isfinite
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from pydantic import (
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    ValidatorFunctionWrapHandler,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from chipglow.quantities.units import Quantity, is_bare_number

_NUMBERS: Final[dict[Any, type]] = {float: Real, int: Integral}
NONE: Final = "none"
"""How descriptions write None."""


@dataclass(frozen=True)
class Parameter:
    """Meaning, unit and limits of a setting: the annotation of a field.

    The field's type is that of Python: a description writes None as ``none``, and a word of a
    ``Literal`` beside a number as it is. Limits are numbers in SI units.

    Parameters
    ----------
    meaning : str
        A sentence.
    quantity : Quantity, optional
        How a description writes it; without one it is a plain number, word or file.
    over, least, under, most : float, optional
        Limits: `over` and `under` are excluded, `least` and `most` are included.
    allowed : str
        Which values are allowed, where the limits do not say it.
    """

    meaning: str
    quantity: Quantity | None = None
    over: float | None = None
    least: float | None = None
    under: float | None = None
    most: float | None = None
    allowed: str = ""

    @property
    def limits(self) -> str:
        """The limits in words, in the unit of descriptions."""
        return self._limits(self.text)

    @property
    def is_limited(self) -> bool:
        """Whether it has limits."""
        return any(one is not None for one in (self.over, self.least, self.under, self.most))

    def text(self, value: float) -> str:
        """Text of a value, as descriptions write it."""
        return f"{value:g}" if self.quantity is None else self.quantity.text(value)

    def number(self, value: object) -> float:
        """SI number of a value as descriptions write it, with its unit if it has one.

        Raises
        ------
        ValueError
            If it is no such number, or outside the limits.
        """
        if self.quantity is not None:
            number = self.quantity.parse(value)
        elif is_bare_number(value):
            number = float(str(value).replace("−", "-"))
        else:
            raise ValueError(f"{value!r}, expected a number without a unit")
        return float(self._within(number))

    def refusal(self, name: str, value: object, kind: Any = float) -> ValueError:
        """The error for a value that is not allowed, in SI units."""
        expected = "" if self.is_limited else _expected(kind) or self.allowed
        expected = expected or self._limits(self._si_text)
        return ValueError(f"{name}: {self._si_text(value)}, expected {expected}")

    def holds(self, value: object) -> bool:
        """Whether a value, or each of a tuple, is within the limits; only numbers have any."""
        if isinstance(value, tuple):
            return all(self.holds(one) for one in value)
        if type(value) is float:  # the usual case, without the time that the others take
            number = value
        elif not isinstance(value, Real) or isinstance(value, bool):
            return True
        else:
            number = float(value)
        return (
            isfinite(number)
            and (self.over is None or number > self.over)
            and (self.least is None or number >= self.least)
            and (self.under is None or number < self.under)
            and (self.most is None or number <= self.most)
        )

    def check(self, kind: Any) -> Callable[[object], bool]:
        """What tells whether a value is of a type, as far as that is checked, and in the limits."""
        is_of = _check(kind)
        return lambda value: is_of(value) and self.holds(value)

    def words(self, kind: Any) -> str:
        """Which values are allowed, in words; empty if anything of the field's type is."""
        none = f"{NONE}, or " if NoneType in get_args(kind) else ""
        return self.allowed or (none + self.limits if self.is_limited else "")

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema of a description's field: text with a unit or a plain value, within the limits."""
        plain, words = self._without_words(source)
        if self.quantity is None:
            schema = handler(plain)
            _take_lists(schema)
        else:
            schema = self.quantity.__get_pydantic_core_schema__(plain, handler)
        schema = core_schema.no_info_after_validator_function(self._within, schema)
        return _or_words(schema, words) if words else schema

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema: a text with a unit, or a plain value with its limits."""
        words = schema.get("metadata", {}).get("words", {})
        text = {"type": "string", "examples": [self.quantity.example]} if self.quantity else None
        json: JsonSchemaValue = text or handler(schema)
        if json.get("type") in ("number", "integer"):
            names = ("exclusiveMinimum", "minimum", "exclusiveMaximum", "maximum")
            limits = (self.over, self.least, self.under, self.most)
            json |= {k: v for k, v in zip(names, limits, strict=True) if v is not None}
        if words:
            allowed = [*words, None] if NONE in words else list(words)
            json = {"anyOf": [json, {"enum": allowed}]}
        return json | {"description": self.meaning}

    def _without_words(self, source: Any) -> tuple[Any, dict[str, Any]]:
        """The type of a value that is no word, and the words with what they stand for."""
        if get_origin(source) not in (Union, UnionType):
            return source, {}
        words: dict[str, Any] = {}
        rest = []
        for one in get_args(source):
            if one is NoneType:
                words[NONE] = None
            elif self.quantity is not None and get_origin(one) is Literal:
                words |= {word: word for word in get_args(one)}
            else:
                rest.append(one)
        return Union[tuple(rest)], words  # noqa: UP007

    def _si_text(self, value: object) -> str:
        if not isinstance(value, Real) or isinstance(value, bool):
            return repr(value)
        return f"{float(value):g} {self.quantity.base if self.quantity else ''}".strip()

    def _limits(self, text: Callable[[float], str]) -> str:
        if self.least is not None and self.most is not None:
            return f"{text(self.least)} to {text(self.most)}"
        words = (
            "" if self.over is None else f"over {text(self.over)}",
            "" if self.least is None else f"{text(self.least)} or more",
            "" if self.under is None else f"under {text(self.under)}",
            "" if self.most is None else f"up to {text(self.most)}",
        )
        return ", ".join(word for word in words if word) or "a finite number"

    def _within(self, value: Any) -> Any:
        if not self.holds(value):
            shown = value if isinstance(value, tuple) else self.text(value)
            raise ValueError(f"{shown}, expected {self.allowed or self.limits}")
        return value


def _take_lists(schema: Any) -> None:
    """Let tuples be read from lists: YAML has no tuples."""
    if isinstance(schema, dict):
        if schema.get("type") == "tuple":
            schema["strict"] = False
        for inner in schema.values():
            _take_lists(inner)
    elif isinstance(schema, list):
        for inner in schema:
            _take_lists(inner)


def _or_words(schema: CoreSchema, words: dict[str, Any]) -> CoreSchema:
    """Schema of a field that may also be one of some words."""
    written = {value: word for word, value in words.items()}

    def read(given: object, rest: ValidatorFunctionWrapHandler) -> object:
        if given is None and NONE in words:
            return None
        return words[given] if isinstance(given, str) and given in words else rest(given)

    def text(held: object, rest: SerializerFunctionWrapHandler, info: SerializationInfo) -> object:
        if held is None or (isinstance(held, str) and held in written):
            return written[held] if info.mode_is_json() else held
        return rest(held)

    return core_schema.no_info_wrap_validator_function(
        read,
        schema,
        metadata={"words": words},
        serialization=core_schema.wrap_serializer_function_ser_schema(
            text, info_arg=True, schema=schema
        ),
    )


def _check(kind: Any) -> Callable[[object], bool]:
    """Whether a value is of a type: numbers, words and classes are told, all else passes."""
    if kind in _NUMBERS:
        number = _NUMBERS[kind]
        return lambda value: (
            type(value) is kind or (isinstance(value, number) and not isinstance(value, bool))
        )
    if isinstance(kind, type) and get_origin(kind) is None:
        return lambda value: isinstance(value, kind)
    origin, members = get_origin(kind), get_args(kind)
    if origin is Literal:
        return lambda value: isinstance(value, str | int) and value in members
    if origin is Annotated:
        return _check(members[0])
    if origin in (Union, UnionType):
        checks = [_check(one) for one in members if one is not NoneType]
        if len(checks) == 1 < len(members):
            (only,) = checks
            return lambda value: value is None or only(value)
        checks = [_check(one) for one in members]
        return lambda value: any(check(value) for check in checks)
    if origin is tuple:
        many, checks = members[-1] is ..., [_check(one) for one in members if one is not ...]
        return lambda value: (
            isinstance(value, tuple)
            and (many or len(value) == len(checks))
            and all(check(one) for check, one in zip(cycle(checks), value, strict=False))
        )
    return lambda value: True


def _expected(kind: Any) -> str:
    """What a type allows, in words; empty for what is not checked."""
    origin, members = get_origin(kind), get_args(kind)
    if origin is Annotated:
        return _expected(members[0])
    if origin is tuple:
        (first, *_), many = members, members[-1] is ...
        of = _PLURALS.get(first) or _expected(first) or "values"
        return f"a tuple of {of}" if many else f"{len(members)} {of}"
    if origin is Literal:
        names = [str(one) for one in members]
    elif origin in (Union, UnionType):
        names = [_expected(one) for one in members]
    elif kind is NoneType:
        return "None"
    else:
        return _NAMES.get(kind) or str(getattr(kind, "__name__", ""))
    return " or ".join(filter(None, (", ".join(names[:-1]), names[-1])))


_NAMES: Final[dict[Any, str]] = {float: "a finite number", int: "a whole number", str: "a text"}
_PLURALS: Final[dict[Any, str]] = {float: "finite numbers", int: "whole numbers", str: "texts"}
