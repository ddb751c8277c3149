"""Parts: objects of the library whose settings are declared once, for Python and descriptions."""

import inspect
import reprlib
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields as dataclass_fields
from functools import cache
from importlib.metadata import entry_points
from inspect import isabstract
from typing import TYPE_CHECKING, Any, ClassVar, Final, Generic, NamedTuple, TypeVar
from warnings import warn

from pydantic import (
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    create_model,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from chipglow.quantities.parameter import Parameter
from chipglow.quantities.section import STRICT, Section, known_keys, naming_file

Class = TypeVar("Class", bound=type)
PartType = TypeVar("PartType")


class Declaration(NamedTuple):
    """A field of a part that descriptions have: annotation, type, parameter, and their check."""

    annotation: Any
    kind: Any
    parameter: Parameter
    allows: Callable[[object], bool]


class Part:
    """A frozen dataclass whose fields declare their `Parameter`.

    From this one declaration come the check of the values, the section of descriptions with its
    comments, errors and JSON schema, and the parameters in the documentation. Fields without a
    `Parameter` are not for descriptions.

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
    _declared: ClassVar[Mapping[str, Declaration]] = {}

    __dataclass_fields__: ClassVar[dict[str, Any]]

    def __init_subclass__(cls, **arguments: Any) -> None:
        super().__init_subclass__(**arguments)
        own = inspect.get_annotations(cls)
        if any(isinstance(annotation, str) for annotation in own.values()):
            own = inspect.get_annotations(cls, eval_str=True)
        inherited = [vars(base).get("_declared", {}) for base in reversed(cls.__mro__[1:])]
        declared = {name: one for each in inherited for name, one in each.items()}
        for name, annotation in own.items():
            metadata = getattr(annotation, "__metadata__", ())
            parameter = next((one for one in metadata if isinstance(one, Parameter)), None)
            if parameter is None:
                declared.pop(name, None)
                continue
            kind = annotation.__origin__
            declared[name] = Declaration(annotation, kind, parameter, parameter.check(kind))
            # The dataclass, `help` and signatures see the plain type.
            cls.__annotations__[name] = kind
        cls._declared = declared
        if "__doc__" in vars(cls) and cls.__doc__ and declared:
            cls.__doc__ = _with_parameters(inspect.cleandoc(cls.__doc__), declared)

    def __post_init__(self) -> None:
        for name, one in self._declared.items():
            value = getattr(self, name)
            if not one.allows(value):
                raise one.parameter.refusal(f"{type(self).__name__}.{name}", value, one.kind)

    @classmethod
    def parameter(cls, name: str) -> Parameter:
        """What a field declares, for a section of a description that has it too."""
        return cls._declared[name].parameter

    @classmethod
    def parameters(cls) -> dict[str, Parameter]:
        """What the fields declare, by their names."""
        return {name: one.parameter for name, one in cls._declared.items()}

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: Any) -> Any:
        """Schema of a section of a description that has the declared fields."""
        if isabstract(cls) or "__dataclass_fields__" not in vars(cls):
            return core_schema.is_instance_schema(cls)
        fields = {
            one.name: core_schema.typed_dict_field(
                handler.generate_schema(cls._declared[one.name].annotation),
                required=one.default is MISSING and one.default_factory is MISSING,
            )
            for one in dataclass_fields(cls)
            if one.name in cls._declared
        }
        if cls.kind:
            kind = core_schema.typed_dict_field(
                core_schema.literal_schema([cls.kind]), required=False
            )
            fields = {"kind": kind, **fields}
        section = core_schema.typed_dict_schema(fields, extra_behavior="forbid", config=STRICT)

        def read(data: object, rest: ValidatorFunctionWrapHandler) -> Part:
            if isinstance(data, cls):
                return data
            values = rest(known_keys(data, fields))
            values.pop("kind", None)
            with naming_file(values):
                part = cls(**values)
            object.__setattr__(part, "given", frozenset(values))
            return part

        def written(part: Part, rest: SerializerFunctionWrapHandler) -> Any:
            return rest({name: getattr(part, name) for name in fields})

        return core_schema.no_info_wrap_validator_function(
            read,
            section,
            serialization=core_schema.wrap_serializer_function_ser_schema(written, schema=section),
        )

    @classmethod
    def __get_pydantic_json_schema__(cls, schema: Any, handler: Any) -> Any:
        """JSON schema of the section."""
        return handler(schema) | {"title": cls.__name__, "description": first_sentence(cls)}


class Parameters(Section, Generic[PartType]):
    """A section with the declared fields of a part: ``Parameters[MeshSource]``."""

    part: ClassVar[Any]

    if TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any: ...

    @classmethod
    def __class_getitem__(cls, part: Any) -> Any:
        """Section of a part."""
        if isinstance(part, TypeVar):
            return super().__class_getitem__(part)
        defaults = {one.name: one.default for one in dataclass_fields(part)}
        fields: dict[str, Any] = {
            name: (one.annotation, defaults[name]) for name, one in part._declared.items()
        }
        made = create_model(f"{part.__name__}Section", __base__=cls, **fields)
        made.part = part
        return made

    @property
    def values(self) -> dict[str, Any]:
        """What the parameters are, by their names."""
        return {name: getattr(self, name) for name in self.part._declared}


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

    def part(self, part: Class) -> Class:
        """Add a part by its `kind`; a decorator."""
        self.add(part.kind, part)  # type: ignore[attr-defined]
        return part

    def add(self, kind: str, part: Any) -> None:
        """Add a part, or a section that is written by hand.

        A class that is defined again, as by a notebook's cell, replaces the one before.
        """
        taken = self._own.get(kind, part)
        same = (taken.__module__, taken.__qualname__) == (part.__module__, part.__qualname__)
        if not kind or not same:
            raise ValueError(f"{self.name}: {kind!r} is no new kind")
        self._own[kind] = part

    @property
    def parts(self) -> dict[str, Any]:
        """All parts by their kind: those of other packages, then the library's own."""
        return {**of_other_packages(f"chipglow.{self.name}"), **self._own}

    def find(self, kind: object) -> Any:
        """The part of a kind, or None; other packages are not loaded for the library's own."""
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

        def chosen(value: Any, info: core_schema.ValidationInfo) -> Any:
            # Looked up when the field is read: parts may be added later.
            if isinstance(value, Part | Section):
                return value
            kind = value.get("kind") if isinstance(value, Mapping) else None
            part = self.find(kind)
            if part is None:
                shown = reprlib.repr(value if kind is None else kind)
                raise ValueError(f"kind: {shown}, expected one of {', '.join(self.kinds)}")
            return adapter(part).validate_python(value, context=info.context)

        def written(part: Any, info: SerializationInfo) -> Any:
            return adapter(type(part)).dump_python(
                part, mode="json" if info.mode_is_json() else "python"
            )

        return core_schema.with_info_plain_validator_function(
            chosen,
            serialization=core_schema.plain_serializer_function_ser_schema(written, info_arg=True),
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema: that of one of the parts."""
        sections = [handler(adapter(part).core_schema) for part in self.parts.values()]
        return {"oneOf": sections, "discriminator": {"propertyName": "kind"}}


adapter: Final[Callable[[Any], TypeAdapter[Any]]] = cache(TypeAdapter)
"""What reads and writes a part or a section, by its class."""


@cache
def of_other_packages(group: str) -> dict[str, Any]:
    """What other packages add by entry points, by name; what cannot be loaded is a warning."""
    found = {}
    for entry in entry_points(group=group):
        try:
            found[entry.name] = entry.load()
        except Exception as error:  # whatever another package does wrong
            warn(f"{entry.value}: cannot be loaded ({error}).", RuntimeWarning, stacklevel=2)
    return found


def first_sentence(part: type) -> str:
    """The first paragraph of a class's documentation, in one line."""
    return " ".join((part.__doc__ or "").split("\n\n")[0].split())


def _with_parameters(text: str, declared: Mapping[str, Declaration]) -> str:
    """A class's documentation with the declared parameters, before those that it has already."""
    title = "Parameters\n----------\n"
    before, found, after = text.partition(title)
    rows = [
        f"{name} : {_type_text(kind, parameter)}\n    " + parameter.meaning.replace("\n", "\n    ")
        for name, (_, kind, parameter, _) in declared.items()
    ]
    before = before if found else before + "\n\n"
    return "\n".join([before + title + "\n".join(rows), after]).rstrip() + "\n"


def _type_text(kind: Any, parameter: Parameter) -> str:
    name = kind.__name__ if isinstance(kind, type) else str(kind).replace("typing.", "")
    return f"{name}, in {parameter.quantity.base}" if parameter.quantity else name
