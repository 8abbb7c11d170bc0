"""What turns notebooks into a book, and a discovery into a report.

`run` executes the notebooks, whose cells hand their results to `artifacts`; `compare` says where
two runs differ, and puts what does in place. `report` writes the pages for those who film,
from templates that lie beside them.
"""
