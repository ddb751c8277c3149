"""The instruments of the laboratory, a room each: computation, description, file and figure."""
