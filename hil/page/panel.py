"""What can be asked on the page, and what is said beside the picture."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from typing import Any, Final

import viser

from hil.page import tables
from hil.page.plots import Plots
from hil.page.scene import Scene
from hil.page.shown import Action, Asked, Offer, Sketch, Snapshot, Told

_RIGHT: Final = 500
_LEFT: Final = 430
"""Widths of the panels [pixels]."""

_NONE: Final = "–"
_FIRST: Final = "power"
"""The kind of fault that is chosen already."""

Ask = Callable[[Asked], None]


class Panel:
    """Everything around the picture.

    Args:
        server: to draw on.
        sketch: the vehicle.
        scene: its picture.
        ask: takes what is asked; from another thread.
    """

    def __init__(self, server: viser.ViserServer, sketch: Sketch, scene: Scene, ask: Ask) -> None:
        self._server = server
        self._sketch = sketch
        self._scene = scene
        self._ask = ask
        self._offers = {one.kind: one for one in sketch.offers}
        self._finished: list[str] = []
        self._step = ""
        self._pace: deque[tuple[float, float]] = deque(maxlen=50)
        self._stopped: bool | None = None
        self._shown_faults: tuple[str, ...] = ()
        server.gui.configure_theme(show_logo=False, show_share_button=False)
        server.gui.set_panel_label(sketch.title)
        self._build()

    def take(self, snapshot: Snapshot) -> None:
        """Note one look."""
        self.plots.take(snapshot)
        self._pace.append((snapshot.wall, snapshot.time))
        doing = snapshot.doing
        # An alignment is told as `aligning for STEP, attempt N of M`; steps have one word.
        if doing.done >= doing.total > 0 and " " not in doing.step and doing.step not in self._finished:
            self._finished.append(doing.step)

    def draw(self, snapshot: Snapshot) -> None:
        """Say what there is to be said."""
        sketch = self._sketch
        self._set(self._headline, tables.headline(snapshot, self._pace_now()))
        self._set(self._nodes, tables.nodes(sketch, snapshot))
        self._set(self._bus, tables.bus(snapshot, self.plots.meter.load, sketch.bit_rate))
        self._set(self._faults, tables.faults(snapshot))
        self._draw_step(snapshot)
        self._draw_faults(snapshot)
        self.plots.draw()

    def tell(self, told: Told) -> None:
        """Show an answer."""
        title = "Refused" if told.refused else "Done"
        colour: Any = "red" if told.refused else "green"
        for client in self._server.get_clients().values():
            client.add_notification(title, told.text, color=colour, auto_close_seconds=6.0)

    def _build(self) -> None:
        gui = self._server.gui
        self._headline = gui.add_html("")
        self._stop = gui.add_button("EMERGENCY STOP", color="red", hint="No drive has power until it is released.")
        self._stop.on_click(lambda _: self._ask(Asked(Action.STOP)))
        self._release = gui.add_button("Release the emergency stop", color="gray", visible=False)
        self._release.on_click(lambda _: self._ask(Asked(Action.RELEASE)))
        self._doing = gui.add_folder("Step", visible=False)
        with self._doing:
            self._step_text = gui.add_html("")
            self._bar = gui.add_progress_bar(0.0)
        with gui.add_folder("Nodes"):
            self._nodes = gui.add_html("")
        with gui.add_folder("Faults"):
            self._build_faults()
        with gui.add_folder("Bus"):
            self._bus = gui.add_html("")
        with gui.add_folder("Picture"):
            gui.add_html(tables.legend(*self._scene.force_scales))
            following = gui.add_checkbox("Follow the vehicle", initial_value=True)
            following.on_update(lambda event: setattr(self._scene, "following", following.value))
            gui.add_button("Forget the path").on_click(lambda _: self._scene.forget_path())
        gui.main_panel.dock_right()
        gui.main_panel.set_width(_RIGHT)
        curves = gui.add_panel()
        with curves.add_tab("Curves, t in s"):
            self.plots = Plots(self._server, self._sketch)
        curves.dock_left()
        curves.set_width(_LEFT)

    def _build_faults(self) -> None:
        gui = self._server.gui
        first = self._offers[_FIRST]
        self._kind = gui.add_dropdown("What", tuple(self._offers), initial_value=first.kind)
        self._place = gui.add_dropdown("Where", first.places)
        self._numbers = gui.add_text("How", "to=2s", hint="NAME=NUMBER,...: from, to, and the numbers of the kind.")
        self._meaning = gui.add_html(_meaning(first))
        self._kind.on_update(lambda _: self._choose_kind())
        gui.add_button("Inject").on_click(lambda _: self._inject())
        gui.add_html('<div style="padding:0 8px;font-size:12px;color:#667">Faults that last:</div>')
        self._faults = gui.add_html("")
        self._which = gui.add_dropdown("Number", [_NONE])
        gui.add_button_group("End", ["this one", "all"]).on_click(self._end)

    def _choose_kind(self) -> None:
        chosen = self._offers[self._kind.value]
        self._place.options = chosen.places
        self._set(self._meaning, _meaning(chosen))

    def _inject(self) -> None:
        numbers = self._numbers.value.strip()
        line = f"{self._kind.value}@{self._place.value}" + (f":{numbers}" if numbers else "")
        self._ask(Asked(Action.INJECT, line))

    def _end(self, event: Any) -> None:
        if event.target.value == "all":
            self._ask(Asked(Action.END_ALL))
        elif self._which.value != _NONE:
            self._ask(Asked(Action.END, self._which.value))

    def _draw_step(self, snapshot: Snapshot) -> None:
        doing = snapshot.doing
        if doing.step:
            self._doing.visible = True
            # A progress bar's value is drawn as it is set, whatever the type hints of its base say.
            self._bar.value = 100.0 * doing.done / max(doing.total, 1)  # type: ignore[misc]
        self._set(self._step_text, tables.step(snapshot, self._finished))

    def _draw_faults(self, snapshot: Snapshot) -> None:
        numbers = tuple(str(one.number) for one in snapshot.faults)
        if numbers != self._shown_faults:
            self._shown_faults = numbers
            self._which.options = numbers or (_NONE,)
        if snapshot.stopped is not self._stopped:
            self._stopped = snapshot.stopped
            self._stop.visible, self._release.visible = not snapshot.stopped, snapshot.stopped

    def _pace_now(self) -> float:
        (wall, time), (wall_now, time_now) = self._pace[0], self._pace[-1]
        return (time_now - time) / (wall_now - wall) if wall_now > wall else 0.0

    @staticmethod
    def _set(handle: viser.GuiHtmlHandle, content: str) -> None:
        if handle.content != content:
            handle.content = content


def _meaning(offer: Offer) -> str:
    numbers = "; ".join(f"<code>{name}</code>: {what}" for name, what in offer.numbers)
    return f'<div style="padding:0 8px;font-size:11px;color:#667">{offer.what}. {numbers}</div>'
