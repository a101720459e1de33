"""Reports: one self-contained page of results that any browser opens, today and later, without a server."""

from slipstick.report.writing import write_report as write_report
