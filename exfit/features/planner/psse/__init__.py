"""PSS/E dynamics files (.dyr): their free format."""
