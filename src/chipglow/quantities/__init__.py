"""Units and their text, values as tables print them, and settings declared once."""

from chipglow.quantities.brief import Brief as Brief, brief as brief
from chipglow.quantities.format import (
    quantity_text as quantity_text,
    rounded_text as rounded_text,
    uncertain_text as uncertain_text,
    uncertainty_text as uncertainty_text,
)
from chipglow.quantities.parameter import Parameter as Parameter, zero_to_one as zero_to_one
from chipglow.quantities.part import (
    Family as Family,
    FileBeside as FileBeside,
    Part as Part,
    Typed as Typed,
    adapter as adapter,
    beside_the_study as beside_the_study,
    made_from as made_from,
    of_other_packages as of_other_packages,
    problem as problem,
    rederived as rederived,
    unchecked as unchecked,
)
from chipglow.quantities.quotient import TINY as TINY, quotient as quotient
from chipglow.quantities.settings import (
    Setting as Setting,
    changed as changed,
    own_settings as own_settings,
    placed as placed,
    setting_at as setting_at,
    settings as settings,
    value_at as value_at,
    value_text as value_text,
)
from chipglow.quantities.units import (
    ROUNDING as ROUNDING,
    SEED as SEED,
    ZERO_CELSIUS as ZERO_CELSIUS,
    Array as Array,
    Quantity as Quantity,
)
