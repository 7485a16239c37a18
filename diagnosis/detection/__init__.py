"""How small an effect may be for records to show it: Fisher's information, and the sizes that follow."""
