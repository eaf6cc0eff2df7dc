"""The page: whole, self-contained, and true to the numbers."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from ident.errors import UserError
from ident.records.record import Record
from ident.report.digits import digits
from ident.report.html import ReportContent, render_report, write_report
from ident.vehicle.parameters import PARAMETER_NAMES

VOID = {"meta", "link", "br", "hr", "img", "input", "col", "wbr"}
LARGEST = 6e6


class Page(HTMLParser):
    """Balanced tags, ids, references and the text of every parameter's row."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.references: list[str] = []
        self.rows: dict[str, list[str]] = {}
        self.text: list[str] = []
        self.scripts: dict[str, str] = {}
        self._row: str | None = None
        self._script: str | None = None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = dict(attrs)
        if tag not in VOID:
            self.open.append(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]
        self.references += [value for name, value in attrs if name in ("src", "href", "data", "action") and value]
        if tag == "tr":
            self._row = attributes.get("data-parameter")
        if tag == "script":
            self._script = attributes.get("id")

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag == "tr":
            self._row = None
        if tag == "script":
            self._script = None

    def handle_data(self, data: str) -> None:
        if self._script is not None:
            self.scripts[self._script] = self.scripts.get(self._script, "") + data
        elif self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)
            if self._row is not None:
                self.rows.setdefault(self._row, []).append(data.strip())

    @property
    def figures(self) -> dict[str, object]:
        figures = json.loads(self.scripts["figures"])
        assert isinstance(figures, dict)
        return figures


@pytest.fixture(scope="module")
def html(content: ReportContent) -> str:
    return render_report(content)


@pytest.fixture(scope="module")
def page(html: str) -> Page:
    return Page(html)


def test_every_tag_is_closed_and_every_id_is_there_once(page: Page) -> None:
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))


def test_every_figure_has_its_place_and_every_link_its_section(page: Page) -> None:
    assert page.figures.keys() <= set(page.ids)
    anchors = {reference[1:] for reference in page.references if reference.startswith("#")}
    assert anchors <= set(page.ids)


def test_nothing_is_loaded_from_anywhere(page: Page, html: str) -> None:
    assert [entry for entry in page.references if not entry.startswith(("#", "data:"))] == []
    style = html[html.index("<style>") : html.index("</style>")]
    assert not re.search(r"@import|url\(", style)


def test_the_file_stays_small_enough_to_send(html: str) -> None:
    assert len(html.encode()) < LARGEST


@pytest.mark.parametrize("name", PARAMETER_NAMES)
def test_every_parameter_is_there_with_the_digits_its_std_supports(
    page: Page, content: ReportContent, name: str
) -> None:
    estimate = content.identification[name]
    cells = page.rows[name]
    assert digits(estimate.value, estimate.std) in cells
    assert digits(estimate.std, estimate.std) in cells
    low, high = (digits(bound, estimate.std) for bound in estimate.ci95)
    assert f"{low} … {high}" in cells
    assert content.truth is not None
    assert digits(content.truth[name], estimate.std) in cells


def test_the_papers_table_2_stands_beside_the_result(page: Page) -> None:
    assert "842.07 ± 0.99" in page.rows["m_ch"]
    assert "paper: 11.56" in "".join(page.text)


def test_titles_and_provenance_are_text_and_not_markup(page: Page) -> None:
    text = "".join(page.text)
    assert "Prototype <1> & its campaign" in text
    assert "runs/<x>/frames.blf" in text


def test_the_callers_warnings_come_with_those_found(page: Page) -> None:
    assert "The floor was wet." in "".join(page.text)


def test_all_sections_of_a_whole_campaign_are_there(page: Page) -> None:
    assert {"summary", "parameters", "identification", "validation", "residuals", "excitation", "path", "control"} <= (
        set(page.ids)
    )
    kinds = {name.rsplit("-", 1)[0] for name in page.figures}
    assert kinds == {"intervals", "torque", "folded", "excitation", "driven"}
    assert sum(name.startswith("torque") for name in page.figures) == 10


def test_a_bare_record_makes_a_report_too(record: Record, content_without: Callable[[Record], ReportContent]) -> None:
    """No lane change, no lifted wheels, no periods, no truth, no plan."""
    floor_steps = [
        replace(segment, period=segment.period * 0 - 1)
        for segment in record.segments
        if segment.step not in ("lane_change", "wheel_lifted")
    ]
    page = Page(render_report(content_without(Record(floor_steps, "bare.csv"))))
    text = "".join(page.text)
    assert page.open == []
    assert not {"validation", "control"} & set(page.ids)
    assert not [name for name in page.figures if name.startswith("folded")]
    assert "No lane change in the record" in text
    assert "No repeated periods in steering_left, steering_right, straight, rotation" in text
    assert "truth" not in page.rows["m_ch"]
    assert "data sheet" in text


def test_table_2_can_be_left_out(content: ReportContent) -> None:
    page = Page(render_report(replace(content, paper=False)))
    assert "842.07 ± 0.99" not in page.rows["m_ch"]
    assert "11.56" not in "".join(page.text)


def test_a_report_is_written_whole_and_leaves_nothing_else(content: ReportContent, tmp_path: Path) -> None:
    path = tmp_path / "runs" / "report.html"
    path.parent.mkdir()
    path.write_text("old")
    write_report(content, path)
    assert path.read_text(encoding="utf-8") == render_report(content)
    assert [entry.name for entry in path.parent.iterdir()] == ["report.html"]


def test_a_place_that_cannot_be_written_is_said(content: ReportContent, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot be written"):
        write_report(content, tmp_path / "file" / "report.html")
