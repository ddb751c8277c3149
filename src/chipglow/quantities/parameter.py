"""The declaration of a setting: what it means, its unit and its limits, in one place."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial, reduce
from math import inf, isfinite, nextafter
from operator import or_
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from pydantic import (
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from chipglow.quantities.units import Quantity, is_bare_number, is_number

NONE: Final = "none"
"""How descriptions write None."""


@dataclass(frozen=True)
class Parameter:
    """Meaning, unit and limits of a setting: the annotation of a field.

    The field has its Python type: a description writes None as ``none``, and a word of a
    ``Literal`` beside a number as it is. Limits are numbers in SI units.

    Parameters
    ----------
    meaning : str
        A sentence.
    quantity : Quantity, optional
        How a description writes it; without one it is a plain number, word or file.
    over, least, under, most : float, optional
        Limits: `over` and `under` are excluded, `least` and `most` are included. A quantity that is
        positive is `over` 0 by itself.
    allowed : str
        Allowed values that the limits do not state.
    """

    meaning: str
    quantity: Quantity | None = None
    over: float | None = None
    least: float | None = None
    under: float | None = None
    most: float | None = None
    allowed: str = ""

    def __post_init__(self) -> None:
        positive = self.quantity is not None and self.quantity.positive
        if positive and self.over is None and self.least is None:
            object.__setattr__(self, "over", 0.0)

    @property
    def limits(self) -> str:
        """The limits in words, in the unit of descriptions."""
        return self._limits(self._text)

    @property
    def extent(self) -> tuple[float, float]:
        """The smallest and the largest number within the limits, in SI units."""
        low = [] if self.over is None else [nextafter(self.over, inf)]
        high = [] if self.under is None else [nextafter(self.under, -inf)]
        low += [] if self.least is None else [self.least]
        high += [] if self.most is None else [self.most]
        return max(low, default=-inf), min(high, default=inf)

    def number(self, value: object) -> float:
        """Return the SI number of a value as descriptions write it; a ValueError if impossible."""
        if self.quantity is not None:
            number = self.quantity.parse(value)
        elif is_bare_number(value):
            number = float(str(value).replace("−", "-"))
        else:
            raise ValueError(f"{value!r}, expected a number without a unit")
        self._check(number, self._text)
        return number

    def check(self, name: str, value: float) -> None:
        """Raise a ValueError with this name if a number in SI units is outside the limits."""
        try:
            self._check(value, self._si_text)
        except ValueError as error:
            raise ValueError(f"{name}: {error}") from None

    def words(self, kind: Any) -> str:
        """Return which values are allowed, in words; empty if anything of the type is."""
        none = f"{NONE}, or " if NoneType in get_args(kind) else ""
        return self.allowed or (none + self.limits if self._is_limited else "")

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        plain, words = self._without_words(source)
        if self.quantity is None:
            schema = handler(mapped(plain, _from_list))
            if self.allowed:
                schema = core_schema.no_info_wrap_validator_function(self._shaped, schema)
        else:
            schema = self.quantity.__get_pydantic_core_schema__(plain, handler)
            tables = tuple(one for one in get_args(plain) or (plain,) if one not in (float, ...))
            if all(isinstance(one, type) for one in tables):
                schema = core_schema.no_info_wrap_validator_function(
                    lambda value, rest: value if isinstance(value, tables) else rest(value), schema
                )
        if self._is_limited:
            schema = core_schema.with_info_wrap_validator_function(self._read, schema)
        return _or_words(schema, words) if words else schema

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        words = schema.get("metadata", {}).get("words", {})
        text = {"type": "string", "examples": [self.quantity.example]} if self.quantity else None
        json: JsonSchemaValue = text or handler(schema)
        if json.get("type") in ("number", "integer"):
            names = ("exclusiveMinimum", "minimum", "exclusiveMaximum", "maximum")
            limits = (self.over, self.least, self.under, self.most)
            json |= {k: v for k, v in zip(names, limits, strict=True) if v is not None}
        if words:
            json = {"anyOf": [json, {"enum": [*words, None] if NONE in words else list(words)}]}
        return json | {"description": self.meaning}

    @property
    def _is_limited(self) -> bool:
        return any(one is not None for one in (self.over, self.least, self.under, self.most))

    def _shaped(self, value: Any, rest: ValidatorFunctionWrapHandler) -> Any:
        """State what is allowed if the whole value is of another type."""
        try:
            return rest(value)
        except ValidationError as error:
            first = error.errors(include_url=False)[0]
            if first["loc"] or first["type"] == "value_error":
                raise
            raise ValueError(f"{value!r}, expected {self.allowed}") from None

    def _read(self, value: Any, rest: ValidatorFunctionWrapHandler, info: ValidationInfo) -> Any:
        """Check the limits: numbers in SI units first, so that the error shows them as given."""
        if info.context is None and isinstance(value, int | float):
            self._check(value, self._si_text)
            return rest(value) if self.quantity is None else float(value)
        read = rest(value)
        self._check(read, self._text)
        return read

    def _check(self, value: Any, text: Callable[[float], str]) -> None:
        """Refuse a number outside the limits, or a tuple with one; all else has none."""
        if isinstance(value, tuple):
            for one in value:
                self._check(one, text)
        elif is_number(value) and not self._holds(value):
            if self.allowed:
                raise ValueError(f"{self._text(value)}, expected {self.allowed}")
            raise ValueError(f"{text(value)}, expected {self._limits(text)}")

    def _holds(self, number: Any) -> bool:
        return (
            isfinite(number)
            and (self.over is None or number > self.over)
            and (self.least is None or number >= self.least)
            and (self.under is None or number < self.under)
            and (self.most is None or number <= self.most)
        )

    def _without_words(self, source: Any) -> tuple[Any, dict[str, Any]]:
        """Return the type of a value that is not a word, and the words with their values."""
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

    def _text(self, value: float) -> str:
        return f"{value:g}" if self.quantity is None else self.quantity.text(value)

    def _si_text(self, value: float) -> str:
        return f"{value:g} {self.quantity.base if self.quantity else ''}".strip()

    def _limits(self, text: Callable[[float], str]) -> str:
        if self.least is not None and self.most is not None:
            return f"{text(self.least)} to {text(self.most)}"
        words = (
            "" if self.over is None else f"more than {text(self.over)}",
            "" if self.least is None else f"{text(self.least)} or more",
            "" if self.under is None else f"less than {text(self.under)}",
            "" if self.most is None else f"up to {text(self.most)}",
        )
        return ", ".join(word for word in words if word) or "a finite number"


zero_to_one: Final = partial(Parameter, least=0.0, most=1.0)
"""Declares a fraction: a number from 0 to 1."""


def mapped(kind: Any, change: Callable[[Any], Any]) -> Any:
    """Return a type after a change, which its arguments undergo first."""
    if get_origin(kind) is Annotated:
        return change(Annotated[mapped(kind.__origin__, change), *kind.__metadata__])
    arguments = get_args(kind)
    if not arguments or get_origin(kind) is Literal:
        return change(kind)
    changed = tuple(
        one if one is Ellipsis or isinstance(one, list) else mapped(one, change)
        for one in arguments
    )
    if get_origin(kind) in (Union, UnionType):
        return change(reduce(or_, changed))
    return change(kind if changed == arguments else get_origin(kind)[changed])


def _from_list(kind: Any) -> Any:
    """Return a type that is also read from a list if it is a tuple: YAML has no tuples."""
    return Annotated[kind, Strict(False)] if get_origin(kind) is tuple else kind


def _or_words(schema: CoreSchema, words: dict[str, Any]) -> CoreSchema:
    """Return the schema of a field that may also be one of some words."""

    def read(given: object, rest: ValidatorFunctionWrapHandler) -> object:
        if given is None and NONE in words:
            return None
        return words[given] if isinstance(given, str) and given in words else rest(given)

    def text(held: object, rest: SerializerFunctionWrapHandler, info: SerializationInfo) -> object:
        if held is None:
            return NONE if info.mode_is_json() else None
        return held if isinstance(held, str) and held in words else rest(held)

    return core_schema.no_info_wrap_validator_function(
        read,
        schema,
        metadata={"words": words},
        serialization=core_schema.wrap_serializer_function_ser_schema(
            text, info_arg=True, schema=schema
        ),
    )
