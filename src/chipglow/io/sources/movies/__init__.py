"""Movies in false colour: their pictures, and the values of the colours."""
