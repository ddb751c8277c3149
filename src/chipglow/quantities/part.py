"""Parts: objects of the library whose settings are declared once, for Python and descriptions."""

import inspect
import re
import reprlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import MISSING, fields as dataclass_fields
from difflib import get_close_matches
from functools import cache
from importlib.metadata import entry_points
from inspect import isabstract
from pathlib import Path
from typing import (
    Annotated,
    Any,
    ClassVar,
    Final,
    Literal,
    NotRequired,
    Self,
    TypeVar,
    get_args,
    get_origin,
)
from warnings import warn

import numpy as np
from pydantic import (
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializationInfo,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema
from typing_extensions import TypedDict

from chipglow.quantities.parameter import Parameter, mapped
from chipglow.quantities.units import is_number

Class = TypeVar("Class", bound=type)
PartType = TypeVar("PartType", bound="Part")


# Not pydantic's own classes: a model takes no values by position, as Emissivity(0.4, 0.03), and its
# copy keeps cached properties of other values; pydantic's dataclasses do not note what was given,
# and call a field given by position 0 in errors.
class Part:
    """A frozen dataclass whose fields declare their `Parameter`.

    From this one declaration come the check of the values, the section of descriptions with its
    comments, errors and JSON schema, and the parameters in the documentation. Fields without a
    `Parameter` are not for descriptions; one that a base class declares can have another default,
    as ``pitch: float = 5e-6``. The constructor takes SI numbers, and what a description
    would give: text with units, and mappings for parts. ``class Other(Part, overrides=One)`` has
    the fields of `One`; each is None by default, for what another source states.

    Attributes
    ----------
    kind : str
        Name by which descriptions choose it among its `Family`; empty for a part of no family.
    example : str
        How a description writes it, for the comment on the choice.
    given : frozenset of str
        Fields that were given when it was made; the others have their defaults, or are derived.
    derived : frozenset of str
        Fields whose value follows from others, as they were not given.

    Raises
    ------
    ValueError
        If a value is not possible; the message names the field and what was expected.
    """

    kind: ClassVar[str] = ""
    example: ClassVar[str] = ""
    given: frozenset[str]
    derived: frozenset[str]
    _annotations: ClassVar[Mapping[str, Any]] = {}
    _parameters: ClassVar[Mapping[str, Parameter]] = {}

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, overrides: "type[Part] | None" = None, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        own = inspect.get_annotations(cls)
        for name, annotation in ({} if overrides is None else overrides._annotations).items():
            own[name] = Annotated[annotation.__origin__ | None, *annotation.__metadata__]
            setattr(cls, name, None)
        if any(isinstance(annotation, str) for annotation in own.values()):
            own = inspect.get_annotations(cls, eval_str=True)
        annotations: dict[str, Any] = {}
        for base in reversed(cls.__mro__[1:]):
            annotations |= vars(base).get("_annotations", {})
        for name, annotation in own.items():
            if _parameter(annotation) is None:  # an inherited field keeps its declaration
                continue
            annotations[name] = annotation
            # The dataclass, `help` and signatures see the plain type.
            cls.__annotations__[name] = _plain(annotation)
        cls._annotations = annotations
        cls._parameters = {name: _parameter(one) for name, one in annotations.items()}
        if "__doc__" in vars(cls) and cls.__doc__ and annotations:
            cls.__doc__ = _with_parameters(inspect.cleandoc(cls.__doc__), annotations)

    def __new__(cls, *args: Any, **values: Any) -> Self:
        """Note which fields are given."""
        part = super().__new__(cls)
        fields = getattr(cls, "__dataclass_fields__", {}).items()
        names = [name for name, one in fields if one.init and not one.kw_only]
        object.__setattr__(part, "given", frozenset([*names[: len(args)], *values]))
        object.__setattr__(part, "derived", frozenset())
        return part

    def __post_init__(self) -> None:
        """Check the given fields, and hold their values in SI."""
        reading, checked = (vars(self).pop(name, None) for name in ("_reading", "_checked"))
        stated = {
            name: value.item() if isinstance(value := getattr(self, name), np.generic) else value
            for name in self._annotations
            if name in self.given and name not in (checked or ())
        }
        if reading is None:
            stated |= self.completed(stated)
        context = None if reading is None else reading.context
        try:
            values = _section(type(self)).validate_python(stated, context=context)
        except ValidationError as error:
            if reading is not None:
                raise
            raise ValueError(f"{type(self).__name__}.{problem(error)}") from None
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "given", self.given | values.keys())

    @classmethod
    def completed(cls, data: Any) -> Any:
        """Return the section's data with those to which its words refer, such as a preset's."""
        return data

    def derive(self, **values: Any) -> None:
        """Set fields that were not given; for `__post_init__`, when the given ones are known."""
        for name in values.keys() - self.given:
            value = values[name]
            if is_number(value):
                self.parameter(name).check(name, value)
            object.__setattr__(self, name, value)
            object.__setattr__(self, "derived", self.derived | {name})

    def stated(self) -> dict[str, Any]:
        """Return the fields that were given, by name, with the kind."""
        fields = {name: getattr(self, name) for name in self.given & self.declared().keys()}
        return {**fields, "kind": self.kind} if self.kind else fields

    @classmethod
    def parameter(cls, name: str) -> Parameter:
        """Return what a field declares, for another part that has it too."""
        return cls._parameters[name]

    @classmethod
    def declared(cls) -> Mapping[str, Parameter]:
        """Return what the fields declare, by their names."""
        return cls._parameters

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """Return the defaults of the declared fields that have one."""
        found = {}
        for one in dataclass_fields(cls):
            if one.name in cls._annotations:
                if one.default_factory is not MISSING:
                    found[one.name] = one.default_factory()
                elif one.default is not MISSING:
                    found[one.name] = one.default
        return found

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        if isabstract(cls) or "__dataclass_fields__" not in vars(cls):
            return core_schema.is_instance_schema(cls)

        def read(data: object, info: ValidationInfo) -> Part:
            if isinstance(data, cls):
                return data
            data = _known_keys(cls.completed({} if data is None else data), cls)
            _check_complete(data, cls)
            values = dict(data)
            if cls.kind and (kind := values.pop("kind", cls.kind)) != cls.kind:
                raise ValueError(f"kind: {kind!r}, expected {cls.kind!r}")
            part = cls.__new__(cls, **values)
            # The constructor checks the fields: by the rules of a description, and only once.
            object.__setattr__(part, "_reading", info)
            try:
                part.__init__(**values)  # type: ignore[misc]
            except OSError as error:  # name the field of a file that cannot be read
                named = [key for key in values if str(getattr(part, key)) == str(error.filename)]
                place = ": ".join([*named, str(error.filename)])
                raise ValueError(f"{place}: {error.strerror}, expected a file") from None
            return part

        def written(part: Part, info: SerializationInfo) -> Any:
            values = {name: getattr(part, name) for name in _keys(cls)}
            return _section(cls).dump_python(values, mode=_mode(info))

        return core_schema.with_info_plain_validator_function(
            read,
            serialization=core_schema.plain_serializer_function_ser_schema(written, info_arg=True),
        )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: GetJsonSchemaHandler) -> Any:
        json = handler.resolve_ref_schema(handler(_section(cls).core_schema))
        plain = _section(cls).dump_python(cls.defaults(), mode="json", warnings=False)
        for name, default in plain.items():
            json["properties"][name]["default"] = default
        if required := [name for name in cls.declared() if name not in plain]:
            json["required"] = required
        return json | {"title": cls.__name__, "description": first_sentence(cls)}


def made_from(kind: type[PartType], checked: "Part", **values: Any) -> PartType:
    """Return a part with the fields that another part has too and has checked, and with values."""
    names = kind.declared().keys() & checked.declared().keys() - values.keys()
    shared = {name: getattr(checked, name) for name in names}
    part = kind.__new__(kind, **shared, **values)
    object.__setattr__(part, "_checked", names)
    part.__init__(**shared, **values)  # type: ignore[misc]
    return part


def unchecked(part: PartType, **values: Any) -> PartType:
    """Return a copy of a part with other values, which nothing checks."""
    made = _copy(part, values)
    object.__setattr__(made, "given", part.given | values.keys())
    object.__setattr__(made, "derived", part.derived - values.keys())
    return made


def rederived(part: PartType, **values: Any) -> PartType:
    """Return a copy of a part whose fields have these values if they were not given.

    Fields that were derived before, and are not among them, have their defaults again.
    """
    defaults = part.defaults()
    made = _copy(part, {name: defaults[name] for name in part.derived})
    object.__setattr__(made, "given", part.given)
    object.__setattr__(made, "derived", frozenset())
    made.derive(**values)
    return made


def _copy(part: PartType, values: Mapping[str, Any]) -> PartType:
    """Return a copy with other values, without cached properties."""
    made = object.__new__(type(part))
    kept = {one.name: getattr(part, one.name) for one in dataclass_fields(part)}
    for name, value in {**kept, **values}.items():
        object.__setattr__(made, name, value)
    return made


class Family:
    """Parts of which a description chooses one by its kind; entry points may add more."""

    def __init__(self, name: str) -> None:
        self.name: Final = name
        self._own: dict[str, Any] = {}

    def part(self, part: Class) -> Class:
        """Add a part by its `kind`; a decorator."""
        self.add(part.kind, part)  # type: ignore[attr-defined]
        return part

    def add(self, kind: str, part: Any) -> None:
        """Add a part; a class that is defined again replaces the one before."""
        taken = self._own.get(kind, part)
        same = (taken.__module__, taken.__qualname__) == (part.__module__, part.__qualname__)
        if not kind or not same:
            raise ValueError(f"{self.name}: {kind!r} is not a new kind")
        self._own[kind] = part

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by their kind: those of other packages, then the library's own."""
        return {**of_other_packages(f"chipglow.{self.name}"), **self._own}

    def find(self, kind: object) -> Any:
        """Return the part of a kind, or None; others are not loaded for the library's own."""
        if not isinstance(kind, str):
            return None
        return self._own.get(kind) or self.parts.get(kind)

    @property
    def kinds(self) -> tuple[str, ...]:
        return tuple(self.parts)

    @property
    def examples(self) -> str:
        found = (getattr(part, "example", "") for part in self.parts.values())
        return "\n".join(f"  {example}" for example in found if example)

    @property
    def example(self) -> str:
        """The first example, as errors show it; "a value" without one."""
        first = self.examples.partition("\n")[0].strip()
        return f"one such as {first}" if first else "a value"

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def chosen(value: Any, info: ValidationInfo) -> Any:
            # Looked up when the field is read: parts may be added later.
            if isinstance(value, Part):
                return value
            kind = value.get("kind") if isinstance(value, Mapping) else None
            part = self.find(kind)
            if part is None:
                if not isinstance(value, Mapping):
                    raise ValueError(f"{reprlib.repr(value)}, expected {self.example}")
                shown = "is missing" if kind is None else reprlib.repr(kind)
                raise ValueError(f"kind: {shown}, expected one of {', '.join(self.kinds)}")
            return adapter(part).validate_python(value, context=info.context)

        def written(part: Any, info: SerializationInfo) -> Any:
            return adapter(type(part)).dump_python(part, mode=_mode(info))

        return core_schema.with_info_plain_validator_function(
            chosen,
            serialization=core_schema.plain_serializer_function_ser_schema(written, info_arg=True),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        sections = [part.__get_pydantic_json_schema__({}, handler) for part in self.parts.values()]
        if not sections:  # a family for the parts of other packages
            return {"not": {}}
        return {"oneOf": sections, "discriminator": {"propertyName": "kind"}}


def families(annotation: Any) -> Iterator[Family]:
    """Yield the families of which an annotation names parts."""
    if isinstance(annotation, Family):
        yield annotation
    else:
        yield from (
            family
            for inner in (*getattr(annotation, "__metadata__", ()), *get_args(annotation))
            for family in families(inner)
        )


adapter: Final[Callable[[Any], TypeAdapter[Any]]] = cache(TypeAdapter)
"""Return the adapter that reads and writes a part, by its class."""


_EXPECTED: Final = {
    "a valid dictionary": "names with values",
    "a valid integer": "a whole number",
    "a valid number": "a number",
    "a valid string": "text",
    "a valid tuple": "a list",
}
"""Expectations of pydantic, in the words of a YAML file."""


def problem(error: ValidationError) -> str:
    """Return the first problem in one line: field, value and what was expected."""
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    if first["type"] == "value_error":
        message = str(first["ctx"]["error"])
    elif first["type"] == "missing":
        message = "is missing, expected a value"
    else:
        expectation = first["msg"].removeprefix("Input should be ").removeprefix("Value should be ")
        expectation = _EXPECTED.get(expectation, expectation)
        message = f"{first['input']!r}, expected {expectation}"
    message = message.removeprefix(f"{place.rpartition('.')[2]}: ")
    return f"{place}: {message}" if place else message


@cache
def of_other_packages(group: str) -> dict[str, Any]:
    """Return what other packages add by entry points; what cannot be loaded is a warning."""
    found = {}
    for entry in entry_points(group=group):
        try:
            found[entry.name] = entry.load()
        except Exception as error:  # whatever another package does wrong
            warn(f"{entry.value}: cannot be loaded ({error}).", RuntimeWarning, stacklevel=2)
    return found


class Typed(str):
    """Text that was typed in a shell: a file that it names is beside the shell's folder."""

    __slots__ = ()


def beside_the_study(file: Any, info: ValidationInfo) -> Any:
    """Return the path of a file that a description names, beside the description."""
    if not isinstance(file, str):
        return file
    folder = "." if isinstance(file, Typed) else (info.context or {}).get("folder") or "."
    path = Path(folder, file)
    # A link keeps its own name, which says what kind of file it is.
    try:
        return str(path.parent.resolve() / path.name)
    except (OSError, RuntimeError):  # Python 3.13 and later let a link to itself be
        raise ValueError(f"{file!r}: its folder is a link to itself") from None


FileBeside = Annotated[str, BeforeValidator(beside_the_study)]
"""A file that a description names."""


def first_sentence(part: type) -> str:
    """Return the first paragraph of a class's documentation, in one line."""
    return " ".join((part.__doc__ or "").split("\n\n")[0].split())


def _fields_of(part: Any) -> TypeAdapter[Any]:
    # Which fields must be given is checked where a part is made.
    fields: dict[str, Any] = {"kind": NotRequired[Literal[part.kind]]} if part.kind else {}
    for name in _keys(part):
        if annotation := part._annotations.get(name):
            fields[name] = NotRequired[annotation]
    typed_dict: Any = TypedDict
    section = typed_dict(part.__name__, fields)
    section.__pydantic_config__ = _CONFIG
    return TypeAdapter(section)


_section: Final[Callable[[Any], TypeAdapter[Any]]] = cache(_fields_of)
"""Return the adapter that reads and writes the declared fields of a part."""


_CONFIG: Final = ConfigDict(
    strict=True, extra="forbid", allow_inf_nan=False, arbitrary_types_allowed=True
)


def _mode(info: SerializationInfo) -> Literal["json", "python"]:
    return "json" if info.mode_is_json() else "python"


def _keys(part: Any) -> list[str]:
    names = [one.name for one in dataclass_fields(part) if one.name in part._annotations]
    return ["kind", *names] if part.kind else names


def _known_keys(data: object, part: Any) -> Mapping[str, Any]:
    known = ", ".join(names := _keys(part))
    if not isinstance(data, Mapping):
        raise ValueError(f"{reprlib.repr(data)} is not a section, expected keys of {known}")
    for key in data:
        if key not in names:
            close = get_close_matches(str(key), names, n=1) or _meaning(str(key), part)
            hint = f"did you mean {close[0]!r}?" if close else f"expected one of {known}"
            raise ValueError(f"unknown key {key!r}, {hint}")
    return data


def _meaning(word: str, part: Any) -> list[str]:
    """Return the setting of which the meaning is a word, such as exposure."""
    declared = part.declared().items()
    return [
        name
        for name, one in declared
        if re.match(rf"{re.escape(word)}( time)?[.,:;]", one.meaning, re.I)
    ]


def _check_complete(data: Mapping[str, Any], part: Any) -> None:
    """Raise a ValidationError with an example if a setting without a default is missing."""
    known = part.defaults().keys() | data.keys()
    if missing := [name for name in part._annotations if name not in known]:
        error = ValueError(f"is missing, expected {_example(part._annotations[missing[0]])}")
        place = (missing[0],)
        line: Any = {"type": "value_error", "loc": place, "input": data, "ctx": {"error": error}}
        raise ValidationError.from_exception_data(part.__name__, [line])


def _example(annotation: Any) -> str:
    """Return an example of a setting; "a value" if it declares none."""
    if family := next(families(annotation), None):
        return family.example
    quantity = _parameter(annotation).quantity
    return quantity.expected.removeprefix("expected ") if quantity else "a value"


def _parameter(annotation: Any) -> Any:
    metadata = getattr(annotation, "__metadata__", ())
    return next((one for one in metadata if isinstance(one, Parameter)), None)


def _with_parameters(text: str, annotations: Mapping[str, Any]) -> str:
    """Return a class's documentation with the declared parameters before its own."""
    title = "Parameters\n----------\n"
    before, found, after = text.partition(title)
    rows = []
    for name, annotation in annotations.items():
        meaning = _parameter(annotation).meaning.replace("\n", "\n    ")
        rows.append(f"{name} : {_type_text(annotation)}\n    {meaning}")
    before = before if found else before + "\n\n"
    return "\n".join([before + title + "\n".join(rows), after]).rstrip() + "\n"


def _plain(annotation: Any) -> Any:
    """Return a type without the metadata of `Annotated`, also in its arguments."""

    def bare(kind: Any) -> Any:
        return kind.__origin__ if get_origin(kind) is Annotated else kind

    return mapped(annotation, bare)


def _type_text(annotation: Any) -> str:
    kind, quantity = _plain(annotation), _parameter(annotation).quantity
    is_plain = isinstance(kind, type) and not get_args(kind)
    name = kind.__name__ if is_plain else str(kind).replace("typing.", "")
    return f"{name}, in {quantity.base}" if quantity else name
