"""PSS/E dynamics files (.dyr): their free format, their records, the units they describe."""
