"""Files from outside: text tables, YAML and what it describes, HDF5 without links, extras."""

from chipglow.text.cells import TableError as TableError
from chipglow.text.description import (
    described_by as described_by,
    load_described as load_described,
    validated as validated,
)
from chipglow.text.extras import install_command as install_command, needs_extra as needs_extra
from chipglow.text.matrix_table import Matrix as Matrix, read_matrix as read_matrix
from chipglow.text.memory import (
    MemoryLimitError as MemoryLimitError,
    check_memory as check_memory,
    memory_limit as memory_limit,
)
from chipglow.text.named_table import (
    NamedTable as NamedTable,
    has_names_of_columns as has_names_of_columns,
    read_named_table as read_named_table,
)
from chipglow.text.notebook import result_html as result_html
from chipglow.text.notes import Notes as Notes
from chipglow.text.own_data import (
    HDF5_ERRORS as HDF5_ERRORS,
    check_bounds as check_bounds,
    check_own_data as check_own_data,
)
from chipglow.text.regular_file import check_regular as check_regular
from chipglow.text.template import commented_yaml as commented_yaml, json_schema as json_schema
from chipglow.text.yaml_file import (
    DescriptionError as DescriptionError,
    parse_yaml as parse_yaml,
    read_small_text as read_small_text,
    read_yaml as read_yaml,
)
