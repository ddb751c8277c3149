"""Tables of the fields of a description for the pages."""

from chipglow.quantities import own_settings


def field_tables(part, name):
    """Return tables in Markdown of a part with this key, and of the parts in it."""
    return "\n".join(table_lines(part, name))


def table_lines(part, name):
    """Yield the lines of the tables."""
    yield from (f"## `{name}`", "", " ".join(type(part).__doc__.split("\n\n")[0].split()), "")
    yield "| field | meaning | unit | default | allowed |"
    yield "|---|---|---|---|---|"
    entries = list(own_settings(part))
    for one in entries:
        if not one.is_section:
            cells = (one.meaning, one.unit, f"`{one.plain}`", one.allowed)
            row = (" ".join(cell.split()).replace("|", r"\|") for cell in cells)
            yield f"| `{one.name}` | {' | '.join(row)} |"
    yield ""
    for one in entries:
        if one.is_section:
            yield from table_lines(one.value, f"{name}.{one.name}")
