"""The settings of a section or a part, one by one: for comments, tables, controls and options."""

from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields, replace
from typing import Any, TypeVar, get_args

from pydantic.fields import FieldInfo

from chipglow.quantities.parameter import Parameter
from chipglow.quantities.part import Family, Part, adapter, first_sentence
from chipglow.quantities.section import Section

Described = TypeVar("Described", bound=Section | Part | tuple[Any, ...] | Mapping[str, Any])


@dataclass(frozen=True)
class Setting:
    """A field of a section or a part.

    Parameters
    ----------
    path : str
        Its keys, joined by dots: ``camera.psf.fwhm``.
    parameter : Parameter
        Meaning, unit and limits.
    kind : type
        Type of its value.
    value : object
        What it is, in SI units; a section or a part where it has settings itself.
    plain : object
        The same as YAML has it: text with a unit, a number, a list or a mapping.
    default : object
        Value that it has if nothing is said; None if it must be given.
    examples : str
        A line for each kind of part that it may be, if a description chooses one.
    """

    path: str
    parameter: Parameter
    kind: Any
    value: Any
    plain: Any
    default: Any = None
    examples: str = ""

    @property
    def name(self) -> str:
        """Its own key."""
        return self.path.rpartition(".")[2]

    @property
    def meaning(self) -> str:
        """A sentence."""
        return self.parameter.meaning

    @property
    def allowed(self) -> str:
        """Which values are allowed, in words; empty if anything of its type is."""
        return self.parameter.words(self.kind)

    @property
    def unit(self) -> str:
        """Unit in which it is written; empty for none."""
        return self.parameter.quantity.unit if self.parameter.quantity else ""

    @property
    def is_section(self) -> bool:
        """Whether it has settings itself."""
        return isinstance(self.value, Section | Part)


def settings(section: Section | Part) -> dict[str, Setting]:
    """All settings of a section or a part and of those within it, by their paths."""
    found = {}
    for one in own_settings(section):
        found[one.path] = one
        if one.is_section:
            inner = settings(one.value)
            for path, each in inner.items():
                found[f"{one.path}.{path}"] = replace(each, path=f"{one.path}.{path}")
    return found


def own_settings(section: Section | Part) -> Iterator[Setting]:
    """The settings of a section or a part itself, in their order."""
    plain = adapter(type(section)).dump_python(section, mode="json")
    for name, (parameter, kind, default, annotation) in _declared(type(section)).items():
        examples = next((family.examples for family in _families(annotation)), "")
        value = getattr(section, name)
        yield Setting(name, parameter, kind, value, plain[name], default, examples)


def value_at(section: Any, path: str) -> Any:
    """Value of a setting by its path, which may lead through lists and mappings.

    Raises
    ------
    LookupError
        If there is no such setting.
    """
    for key in path.split("."):
        if isinstance(section, tuple):
            section = dict(enumerate(section))[int(key) if key.isdigit() else -1]
        elif isinstance(section, Mapping):
            section = section[key]
        elif isinstance(section, Section | Part) and key in _declared(type(section)):
            section = getattr(section, key)
        else:
            raise LookupError(path)
    return section


def setting_at(section: Section | Part, path: str) -> Setting:
    """Setting by its path; one in a list or a mapping has unit and type of the whole.

    Raises
    ------
    LookupError
        If there is no such setting.
    """
    keys, at = path.split("."), 0
    for count in range(1, len(keys)):
        inner = value_at(section, ".".join(keys[:count]))
        if isinstance(inner, Section | Part):
            at = count
    owner = value_at(section, ".".join(keys[:at])) if at else section
    found = {one.name: one for one in own_settings(owner)}[keys[at]]
    return replace(found, path=path, value=value_at(section, path))


def given(section: Section | Part) -> frozenset[str]:
    """Fields that a description gave; all of a part that was made in Python."""
    if isinstance(section, Section):
        return frozenset(section.model_fields_set)
    return getattr(section, "given", frozenset(section.parameters()))


def changed(section: Described, changes: Mapping[str, object]) -> Described:
    """A copy with other values, all of them checked.

    Parameters
    ----------
    section : Section, Part, tuple or mapping
        The section.
    changes : mapping
        New values by their paths, as of `value_at`: numbers in SI units, text with units, mappings
        or parts.

    Raises
    ------
    pydantic.ValidationError
        If a value is not possible; a ValueError.
    """
    made: Described = adapter(type(section)).validate_python(_with_changes(section, changes))
    return made


def _with_changes(section: Any, changes: Mapping[str, object]) -> Any:
    """What a description gave of a section, a mapping or a list, with the changes."""
    if isinstance(section, Mapping):
        data = dict(section)
    elif isinstance(section, tuple):
        data = {str(number): one for number, one in enumerate(section)}
    else:
        data = {name: getattr(section, name) for name in given(section)}
        if getattr(section, "kind", ""):
            data["kind"] = section.kind
    inner: dict[str, dict[str, object]] = {}
    for path, value in changes.items():
        name, dot, rest = path.partition(".")
        if dot:
            inner.setdefault(name, {})[rest] = value
        else:
            data[name] = value
    for name, one in inner.items():
        data[name] = _with_changes(value_at(section, name), one)
    return tuple(data.values()) if isinstance(section, tuple) else data


def field_tables(section: Section | Part, name: str) -> str:
    """Tables in Markdown of a section with this key, and of the sections in it."""
    return "\n".join(_table_lines(section, name))


def _table_lines(section: Section | Part, name: str) -> Iterator[str]:
    yield from (f"## `{name}`", "", first_sentence(type(section)), "")
    yield "| field | meaning | unit | default | allowed |"
    yield "|---|---|---|---|---|"
    inner = []
    for one in own_settings(section):
        if one.is_section:
            inner.append(one)
            continue
        cells = (one.meaning, one.unit, f"`{one.plain}`", one.allowed)
        row = (" ".join(cell.split()).replace("|", r"\|") for cell in cells)
        yield f"| `{one.name}` | {' | '.join(row)} |"
    yield ""
    for one in inner:
        yield from _table_lines(one.value, f"{name}.{one.name}")


def _declared(kind: Any) -> dict[str, tuple[Parameter, Any, Any, Any]]:
    """Parameter, type, default and annotation of each field."""
    if issubclass(kind, Section):
        return {name: _of_model(one) for name, one in kind.model_fields.items()}
    found = {}
    if kind.kind:
        found["kind"] = (Parameter(first_sentence(kind)), str, kind.kind, str)
    for one in fields(kind):
        if one.name in kind.parameters():
            annotation, plain, parameter, _ = kind._declared[one.name]
            default = _default(one.default, one.default_factory)
            found[one.name] = parameter, plain, default, annotation
    return found


def _of_model(field: FieldInfo) -> tuple[Parameter, Any, Any, Any]:
    parameters = [one for one in field.metadata if isinstance(one, Parameter)]
    parameter = parameters[0] if parameters else Parameter(field.description or "")
    default = None if field.is_required() else field.get_default(call_default_factory=True)
    return parameter, field.annotation, default, (field.annotation, *field.metadata)


def _families(annotation: Any) -> Iterator[Family]:
    if isinstance(annotation, Family):
        yield annotation
    elif isinstance(annotation, tuple):
        for one in annotation:
            yield from _families(one)
    else:
        yield from _families(getattr(annotation, "__metadata__", ()))
        yield from _families(get_args(annotation))


def _default(value: Any, factory: Any) -> Any:
    if factory is not MISSING:
        return factory()
    return None if value is MISSING else value
