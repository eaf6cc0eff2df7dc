"""Do these files belong together, and what is assumed? The answer is a list of findings."""

from hil.checking.files import Checked, FileKind, Verdict, check_files
from hil.checking.findings import Finding, Severity
from hil.checking.records import check_records

__all__ = ["Checked", "FileKind", "Finding", "Severity", "Verdict", "check_files", "check_records"]
