"""Parts that a description can choose: parameters declared once, kinds found by their name."""

import inspect
import re
import reprlib
from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import MISSING, Field, dataclass, fields
from functools import cache, cached_property
from importlib.metadata import entry_points
from math import isfinite
from numbers import Integral, Real
from types import NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Any,
    ClassVar,
    Final,
    Generic,
    Literal,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
    get_type_hints,
)
from warnings import warn

import pydantic
from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, create_model, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from chipglow.quantities.section import OR_NONE, Section, described, or_the_word, or_word
from chipglow.quantities.units import Quantity, is_bare_number

Built = TypeVar("Built")
PartType = TypeVar("PartType", bound="type[Part | Section]")


@dataclass(frozen=True)
class Parameter:
    """What a parameter means, how descriptions write it and which values it may have.

    An annotation of a part's field. Limits are numbers in SI; those of a range or of a text are
    its type's own.

    Parameters
    ----------
    meaning : str
        A sentence.
    quantity : Quantity, optional
        How a description writes it; without one it is a plain number, word or file.
    over, least, under, most : float, optional
        Limits: `over` and `under` are not reached, `least` and `most` are.
    """

    meaning: str
    quantity: Quantity | None = None
    over: float | None = None
    least: float | None = None
    under: float | None = None
    most: float | None = None

    @property
    def limits(self) -> str:
        """The values it may have, in words and in the unit of descriptions."""
        return self._limits(self.text)

    @property
    def si_limits(self) -> str:
        """The same in SI units."""
        return self._limits(self.si_text)

    @property
    def is_limited(self) -> bool:
        """Whether it has limits."""
        return any(one is not None for one in (self.over, self.least, self.under, self.most))

    def text(self, value: float) -> str:
        """A value as descriptions write it."""
        return f"{value:g}" if self.quantity is None else self.quantity.text(value)

    def si_text(self, value: object) -> str:
        """A value in SI units."""
        if not isinstance(value, Real) or isinstance(value, bool):
            return repr(value)
        return f"{float(value):g} {self.quantity.base if self.quantity else ''}".strip()

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

    def refusal(self, name: str, value: object) -> ValueError:
        """The error for a value that it may not have, in SI units."""
        return ValueError(f"{name}: {self.si_text(value)}, expected {self.si_limits}")

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

    def holds(self, value: object) -> bool:
        """Whether a value is within the limits; what is no number has none."""
        if not isinstance(value, Real) or isinstance(value, bool):
            return True
        number = float(value)
        return (
            isfinite(number)
            and (self.over is None or number > self.over)
            and (self.least is None or number >= self.least)
            and (self.under is None or number < self.under)
            and (self.most is None or number <= self.most)
        )

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema of a description's field: text with a unit or a plain value, within the limits."""
        plain, optional = _without_none(source)
        if self.quantity is None:
            schema = handler(source)
        else:
            schema = self.quantity.__get_pydantic_core_schema__(plain, handler)
        schema = core_schema.no_info_after_validator_function(self._within, schema)
        return or_word(schema, OR_NONE.word, OR_NONE.value) if optional else schema

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema: a text with a unit, or a plain value with its limits."""
        text = {"type": "string", "examples": [self.quantity.example]} if self.quantity else None
        json: JsonSchemaValue = text or handler(schema)
        if json.get("type") in ("number", "integer"):
            names = ("exclusiveMinimum", "minimum", "exclusiveMaximum", "maximum")
            limits = (self.over, self.least, self.under, self.most)
            json |= {k: v for k, v in zip(names, limits, strict=True) if v is not None}
        optional = schema["type"] == "function-wrap"  # `or_word` made it
        return or_the_word(json, OR_NONE.word) if optional else json

    def _within(self, value: Any) -> Any:
        if not self.holds(value):
            raise ValueError(f"{self.text(value)}, expected {self.limits}")
        return value


class Part:
    """A frozen dataclass whose fields declare their `Parameter`.

    From this one declaration come the check of the values, the section of descriptions with its
    comments, errors and JSON schema (`Declared`), and the parameters in the documentation. Fields
    without a `Parameter` are not for descriptions.

    Attributes
    ----------
    kind : str
        Name by which descriptions choose it among its `Family`; empty for a part of no family.
    example : str
        How a description writes it, for the comment on the choice.

    Raises
    ------
    ValueError
        If a value is outside its limits.
    """

    kind: ClassVar[str] = ""
    example: ClassVar[str] = ""

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        own = inspect.cleandoc(cls.__dict__.get("__doc__") or "")
        if own and (rows := _documented(cls)):
            cls.__doc__ = _with_parameters(own, rows)

    def __post_init__(self) -> None:
        part: Any = type(self)
        for name, (parameter, annotation) in _declared(part).items():
            value = getattr(self, name)
            if not (_is_of(value, annotation) and parameter.holds(value)):
                raise parameter.refusal(f"{type(self).__name__}.{name}", value)


def parameters(part: Any) -> dict[str, Parameter]:
    """What a part's fields declare, by their names."""
    return {name: found for name, (found, _) in _declared(part).items()}


class Settings(Section, Generic[Built]):
    """A section that describes one object of the library, which says what is possible."""

    @abstractmethod
    def build(self) -> Built:
        """The object that this section describes."""

    @model_validator(mode="after")
    def _possible(self) -> Self:
        try:
            self.build()
        except OSError as error:
            named = [name for name, value in self if str(value) == str(error.filename)]
            place = ": ".join([*named, str(error.filename)])
            raise ValueError(f"{place}: {error.strerror}, expected a file") from None
        return self


class Parameters(Section, Generic[Built]):
    """The parameters of a part, as the fields of a section: ``Parameters[MeshSource]``."""

    part: ClassVar[type[Part]]

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    @classmethod
    def __class_getitem__(cls, part: Any) -> Any:
        """Section of a part; of one that is abstract this class."""
        if isinstance(part, TypeVar):
            return super().__class_getitem__(part)
        return _section(part, cls) if hasattr(part, "__dataclass_fields__") else cls

    @property
    def values(self) -> dict[str, Any]:
        """What the parameters are, by their names."""
        return {name: getattr(self, name) for name in parameters(self.part)}


class Declared(Parameters[Built], Settings[Built]):
    """The section of a part: ``Declared[Friction]`` has its parameters, and builds it."""

    def build(self) -> Built:
        """The part; a file that it names is read once."""
        return self._built

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with other values; its part is built from them."""
        copied = super().model_copy(update=update, deep=deep)
        copied.__dict__.pop("_built", None)
        return copied

    @cached_property
    def _built(self) -> Built:
        built: Any = self.part(**self.values)
        return built  # type: ignore[no-any-return]


class Family:
    """Parts of which a description chooses one by its kind.

    An annotation of a description's field. Other packages add theirs by an entry point in the
    group ``chipglow.<name>``.

    Parameters
    ----------
    name : str
        What the family is called, and the field of descriptions that chooses.
    """

    def __init__(self, name: str) -> None:
        self.name: Final = name
        self._own: dict[str, Any] = {}

    def part(self, part: PartType) -> PartType:
        """Add a part, or a section that is written by hand, by its `kind`; a decorator."""
        self.add(part.kind, part)  # type: ignore[union-attr]
        return part

    def add(self, kind: str, part: "type[Part | Section]") -> None:
        """Add a part, or a section of descriptions that is written by hand.

        A class that is defined anew, as by a notebook's cell, takes the place of the one before.

        Raises
        ------
        ValueError
            If the kind is empty or that of another class.
        """
        taken = self._own.get(kind, part)
        if not kind or _place(taken) != _place(part):
            raise ValueError(f"{self.name}: {kind!r} is no new kind")
        self._own[kind] = part

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by their kind: those of other packages, then the library's own."""
        return {**of_other_packages(f"chipglow.{self.name}"), **self._own}

    def find(self, kind: object) -> "type[Part | Section] | None":
        """The part of a kind, if there is one; other packages are not loaded for the own ones."""
        if not isinstance(kind, str):
            return None
        return self._own.get(kind) or self.parts.get(kind)

    @property
    def kinds(self) -> tuple[str, ...]:
        """Names of the kinds."""
        return tuple(self.parts)

    @property
    def examples(self) -> str:
        """A line for each kind with an example."""
        found = (getattr(part, "example", "") for part in self.parts.values())
        return "\n".join(f"  {example}" for example in found if example)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema of the field: the section of the part whose kind is chosen."""
        return core_schema.with_info_plain_validator_function(
            self._chosen,
            serialization=core_schema.plain_serializer_function_ser_schema(
                lambda section: section.model_dump(mode="json"), when_used="json"
            ),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema: that of one of the parts."""
        sections = {
            kind: _section_of(part).__pydantic_core_schema__ for kind, part in self.parts.items()
        }
        return handler(core_schema.tagged_union_schema(sections, discriminator="kind"))

    def _chosen(self, value: Any, info: core_schema.ValidationInfo) -> Section:
        """The section of the kind that is chosen when the field is read: parts may come later."""
        if isinstance(value, Section):
            return value
        kind = value.get("kind") if isinstance(value, Mapping) else None
        part = self.find(kind)
        if part is None:
            shown = reprlib.repr(value if kind is None else kind)
            raise ValueError(f"kind: {shown}, expected one of {', '.join(self.kinds)}")
        return _section_of(part).model_validate(value, context=info.context)


@cache
def of_other_packages(group: str) -> dict[str, Any]:
    """What other packages add by entry points, by their names; a warning for what cannot be loaded.

    Parameters
    ----------
    group : str
        Group of the entry points.
    """
    found = {}
    for entry in entry_points(group=group):
        try:
            found[entry.name] = entry.load()
        except Exception as error:  # whatever another package does wrong
            warn(f"{entry.value}: cannot be loaded ({error}).", RuntimeWarning, stacklevel=2)
    return found


def _place(part: type) -> tuple[str, str]:
    return part.__module__, part.__qualname__


def _section_of(part: Any) -> type[Section]:
    section: type[Section] = part if issubclass(part, Section) else _section(part, Declared)
    return section


@cache
def _declared(part: Any) -> dict[str, tuple[Parameter, Any]]:
    """Parameter and annotation of each field that declares one."""
    hints = get_type_hints(part, include_extras=True)
    found = {}
    for one in fields(part):
        for metadata in getattr(hints[one.name], "__metadata__", ()):
            if isinstance(metadata, Parameter):
                found[one.name] = (metadata, hints[one.name])
    return found


@cache
def _section(part: Any, base: Any) -> Any:
    definitions: dict[str, Any] = {}
    if part.kind:
        definitions["kind"] = (Literal[part.kind], described(part.kind, _first_sentence(part)))
    defaults = {one.name: one for one in fields(part)}
    for name, (parameter, annotation) in _declared(part).items():
        definitions[name] = (annotation, _field(parameter, defaults[name]))
    made = create_model(
        f"{part.__name__}Section",
        __base__=base,
        __module__=part.__module__,
        __doc__=_first_sentence(part),
        **definitions,
    )
    made.part = part
    return made


def _field(parameter: Parameter, one: Field[Any]) -> Any:
    none = "none, or " if one.default is None else ""
    extra: dict[str, Any] = {"allowed": none + parameter.limits if parameter.is_limited else ""}
    if one.default is MISSING:
        return pydantic.Field(description=parameter.meaning, json_schema_extra=extra)
    return pydantic.Field(
        default_factory=lambda: _written(parameter, one.default),
        description=parameter.meaning,
        json_schema_extra=extra,
        validate_default=True,
    )


def _written(parameter: Parameter, value: Any) -> Any:
    if parameter.quantity is None or value is None:
        return value
    return parameter.quantity.written(value)


def _is_of(value: object, annotation: Any) -> bool:
    """Whether a value is a number, where one is expected."""
    plain, optional = _without_none(get_args(annotation)[0])
    if value is None:
        return optional
    number = {float: Real, int: Integral}.get(plain)
    return number is None or (isinstance(value, number) and not isinstance(value, bool))


def _without_none(source: Any) -> tuple[Any, bool]:
    if get_origin(source) not in (Union, UnionType):
        return source, False
    rest = tuple(one for one in get_args(source) if one is not NoneType)
    return Union[rest], len(rest) < len(get_args(source))  # noqa: UP007


def _first_sentence(part: type[Part]) -> str:
    return " ".join((part.__doc__ or "").split("\n\n")[0].split())


def _with_parameters(text: str, rows: dict[str, str]) -> str:
    """A class's documentation with rows of its parameters, after those that it has already."""
    blocks = text.split("\n\n")
    titles = [i for i, block in enumerate(blocks) if re.match(r"\w+\n-+\n", block)]
    at = titles[0] if titles else len(blocks)
    if not (titles and blocks[at].startswith("Parameters\n")):
        blocks.insert(at, "Parameters\n----------")
    heads = re.findall(r"^(\w.*?) :", blocks[at], re.MULTILINE)
    told = {name for head in heads for name in head.split(", ")}
    blocks[at] = "\n".join([blocks[at], *(row for name, row in rows.items() if name not in told)])
    return "\n\n".join(blocks)


def _documented(cls: type[Part]) -> dict[str, str]:
    """Rows of the documentation for the parameters of a class that is being made."""
    rows = {}
    annotations = [inspect.get_annotations(one) for one in reversed(cls.__mro__)]
    for name, annotation in [pair for one in annotations for pair in one.items()]:
        for metadata in getattr(annotation, "__metadata__", ()):
            if isinstance(metadata, Parameter):
                meaning = metadata.meaning.replace("\n", "\n    ")
                rows[name] = f"{name} : {_type_text(annotation, metadata)}\n    {meaning}"
    return rows


def _type_text(annotation: Any, parameter: Parameter) -> str:
    plain = get_args(annotation)[0]
    name = plain.__name__ if isinstance(plain, type) else str(plain).replace("typing.", "")
    return f"{name}, in {parameter.quantity.base}" if parameter.quantity else name
