"""What a section of a YAML file is: known keys only, each described, built into one object."""

import reprlib
from collections.abc import Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema


def or_word(schema: CoreSchema, word: str, value: object) -> CoreSchema:
    """Schema of a field that may also hold one value, which descriptions write as a word."""

    def read(given: object, rest: ValidatorFunctionWrapHandler) -> object:
        return value if given is value or given == word else rest(given)

    def written(held: object, rest: SerializerFunctionWrapHandler) -> object:
        return word if held == value else rest(held)

    return core_schema.no_info_wrap_validator_function(
        read,
        schema,
        serialization=core_schema.wrap_serializer_function_ser_schema(
            written, schema=schema, when_used="json"
        ),
    )


def or_the_word(schema: JsonSchemaValue, word: str) -> JsonSchemaValue:
    """JSON schema of a field that may also be a word."""
    return {"anyOf": [schema, {"const": word}]}


@dataclass(frozen=True)
class OrWord:
    """Annotation of a field that may also hold one value, which descriptions write as a word.

    Parameters
    ----------
    word : str
        The word.
    value : object
        What the field then holds.
    """

    word: str
    value: object

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Schema of the field, or the word."""
        return or_word(handler(source), self.word, self.value)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        """JSON schema of the field, or the word."""
        return or_the_word(handler(schema), self.word)


OR_NONE: Final = OrWord("none", None)
"""Annotation of a field that may be none."""


def beside_the_study(file: str, info: ValidationInfo) -> str:
    """Path of a file that a study names: relative to the study's folder.

    A link keeps its own name, which says what kind of file it is.
    """
    path = Path((info.context or {}).get("folder") or ".", file)
    try:
        return str(path.parent.resolve() / path.name)
    except (OSError, RuntimeError):  # Python 3.13 and later let a link to itself be
        raise ValueError(f"{file!r}: its folder is a link to itself") from None


FileBeside = Annotated[str, AfterValidator(beside_the_study)]
"""A file that a study names."""


def described(default: object, description: str, allowed: str = "") -> Any:
    """Field with its default as a YAML file would give it, its meaning and what is allowed."""
    extra: dict[str, Any] = {"allowed": allowed}
    return Field(default, description=description, json_schema_extra=extra, validate_default=True)


def allowed(field: FieldInfo) -> str:
    """What a field may be, in words; empty if its description says it."""
    extra = field.json_schema_extra
    return str(extra.get("allowed", "")) if isinstance(extra, Mapping) else ""


class Section(BaseModel):
    """A section of a study. Unknown keys are refused, an empty section means the defaults."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, data: object) -> object:
        if data is None:
            return {}
        if isinstance(data, Section):
            return data
        known = ", ".join(cls.model_fields)
        if not isinstance(data, Mapping):
            raise ValueError(f"{reprlib.repr(data)} is no section, expected keys of {known}")
        for key in data:
            if key not in cls.model_fields:
                close = get_close_matches(str(key), list(cls.model_fields), n=1)
                hint = f"did you mean {close[0]!r}?" if close else f"expected one of {known}"
                raise ValueError(f"unknown key {key!r}, {hint}")
        return data
