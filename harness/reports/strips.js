// The curves under a game: speed, time to collision, gap, acceleration and steering of its players. uPlot draws them.

const STRIPS = [
  { name: "speed", unit: "m/s", column: "speed", from: 0 },
  { name: "time to collision", unit: "s", column: "time", from: 0, most: 10 },
  { name: "gap ahead", unit: "m", column: "gap", from: 0, most: 60 },
  { name: "acceleration", unit: "m/s²", column: "acceleration", from: -1, to: 1 },
  { name: "steering", unit: "°", column: "steering", factor: 180 / Math.PI, from: -2, to: 2 },
];
const ROW = 46, AXIS = 20, LEFT = 34, RIGHT = 10;
const TOGETHER = 8; // in % of the width: manoeuvres that begin closer to one another share a label

/** The strips of some games, without those that would be empty: each with its range over all of them, so that games
    side by side have the same axes. */
function stripsOf(shown) {
  const tracks = shown.flatMap(game => game.players);
  const measured = STRIPS.filter(({ column }) => tracks.some(track => track[column].some(value => !Number.isNaN(value))));
  return measured.map(strip => {
    const { column, factor = 1, from = 0, to = 0.1, most = Infinity } = strip;
    let [low, high] = [from, to];
    for (const track of tracks) {
      for (const value of track[column]) {
        if (Number.isNaN(value)) continue;
        low = Math.min(low, value * factor);
        high = Math.max(high, Math.min(value * factor, most));
      }
    }
    return { ...strip, range: [low, high + 0.04 * (high - low)] };
  });
}

/** Two or three round values of an axis. */
function ticks(low, high) {
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find(each => (high - low) / each <= 2.6) ?? 200;
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9; n++) found.push(Math.round(n * step * 10) / 10 || 0);
  return found;
}

class Strips {
  /** The curves of a game in an element of the page; `seek` is called with the time of a click or a drag. */
  constructor(element, game, seek) {
    Object.assign(this, { element, game, time: 0, until: game.duration, pointed: null, plots: [] });
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(element);
    this.again = () => { for (const { plot } of this.plots) plot.redraw(); };
    repaint.add(this.again);
    this.onDrag(seek);
  }

  /** Draw the strips of all games that are shown. */
  align(strips, until) {
    this.until = until;
    for (const { plot } of this.plots) plot.destroy();
    this.element.replaceChildren(...this.lanes());
    this.plots = strips.map((strip, row) => this.plotted(strip, row === strips.length - 1));
    this.draw(this.time);
  }

  /** Dragging over the curves moves through time. */
  onDrag(seek) {
    const at = event => {
      const { left, width } = this.element.getBoundingClientRect();
      const share = (event.clientX - left - LEFT) / (width - LEFT - RIGHT);
      return Math.min(Math.max(share, 0), 1) * this.until;
    };
    this.element.addEventListener("pointerdown", event => { this.element.setPointerCapture(event.pointerId); seek(at(event)); });
    this.element.addEventListener("pointermove", event => {
      if (event.buttons & 1 && this.element.hasPointerCapture(event.pointerId)) seek(at(event));
      this.point(event.pointerType === "mouse" ? at(event) : null);
    });
    this.element.addEventListener("pointerleave", () => this.point(null));
  }

  /** Show the values of the time under the pointer; null: of the time of the game. */
  point(time) {
    this.pointed = time;
    this.draw(this.time);
  }

  /** What the players did, a line for each of them. */
  lanes() {
    const marked = this.game.players.filter(track => this.game.marks.some(mark => mark.player === track.name));
    return marked.map(track => {
      const lane = make("div", { class: `lane ${track.name === "ego" ? "of-ego" : "of-non-ego"}` });
      let labelled = null, labelledAt = -Infinity;
      for (const mark of this.game.marks.filter(each => each.player === track.name)) {
        const [from, to] = [mark.from, mark.until].map(time => 100 * time / (this.until || 1));
        const span = make("span", { text: mark.name, title: `${mark.from.toFixed(1)} s: ${mark.name} ${mark.text ?? ""}`.trim() });
        if (from > 70) span.className = "before";
        span.style.left = `${from}%`;
        span.style.setProperty("--long", `${Math.max(to - from, 0.4)}%`);
        const bar = make("i");
        bar.style.left = `${from}%`;
        bar.style.width = `${Math.max(to - from, 0.4)}%`;
        lane.append(bar, span);
        if (from - labelledAt < TOGETHER) {
          labelled.textContent += `, ${mark.name}`;
          span.textContent = "";
        } else {
          [labelled, labelledAt] = [span, from];
        }
      }
      return lane;
    });
  }

  /** One strip: its heading with the values of the moment, and its plot. */
  plotted({ name, unit, column, factor = 1, range: [low, high] }, last) {
    const { game } = this;
    const values = game.players.map(track => make("b", { class: track.name === "ego" ? "ego" : "non-ego" }));
    const place = make("div");
    this.element.append(make("p", { class: "strip" }, make("span", { text: `${name} (${unit})` }), ...values), place);
    const times = Array.from({ length: game.steps + 1 }, (_, step) => step * game.step);
    const series = game.players.map(track => times.map((_, step) => {
      const value = track[column][step - track.first] * factor; // undefined * factor: NaN
      return Number.isNaN(value) ? null : Math.min(Math.max(value, low), high);
    }));
    const axis = { stroke: () => palette.faint, font: FONT, ticks: { show: false } };
    const plot = new uPlot({
      width: this.width(), height: ROW + (last ? AXIS : 0), padding: [3, RIGHT, 3, 0],
      legend: { show: false }, cursor: { show: false },
      scales: { x: { time: false, range: () => [0, this.until || 1] }, y: { range: () => [low, high] } },
      axes: [
        { ...axis, show: last, size: AXIS, gap: 2, space: 45, grid: { show: false }, values: (_, times) => times.map(time => `${time} s`) },
        { ...axis, size: LEFT, gap: 3, grid: { stroke: () => palette.grid, width: 1 }, splits: () => ticks(low, high),
          values: (_, found) => found.map(value => String(value).replace("-", "−")) },
      ],
      series: [{}, ...game.players.map(track => ({ stroke: () => colourOf(track), width: 1.8, points: { show: false } }))],
      hooks: { drawAxes: [plot => this.drawLapses(plot)], draw: [plot => this.drawTouches(plot)] },
    }, [times, ...series], place);
    const head = make("div", { class: "head" });
    plot.over.append(head);
    return { plot, head, values, column, factor };
  }

  drawLapses(plot) {
    const { context, y, bottom } = this.inside(plot);
    context.fillStyle = palette.lapse;
    context.globalAlpha = 0.16;
    for (const track of this.game.players) {
      for (let step = 0; step < track.count; step++) {
        if (!track.lapsed[step]) continue;
        const begun = step;
        while (track.lapsed[step + 1]) step++;
        const [from, to] = [begun - 1, step].map(each => plot.valToPos(Math.max(track.first + each, 0) * this.game.step, "x", true));
        context.fillRect(from, y, to - from, bottom - y);
      }
    }
    context.restore();
  }

  drawTouches(plot) {
    const { context, y, bottom } = this.inside(plot);
    context.strokeStyle = palette.contact;
    context.lineWidth = 1.5 * (window.devicePixelRatio || 1);
    context.setLineDash([5, 4]);
    for (const touch of this.game.touches) {
      const x = plot.valToPos(touch.time, "x", true);
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x, bottom);
      context.stroke();
    }
    context.restore();
  }

  /** The context of a plot, saved, and the upper and lower edge of its area in pixels of its canvas. */
  inside(plot) {
    plot.ctx.save();
    return { context: plot.ctx, y: plot.bbox.top, bottom: plot.bbox.top + plot.bbox.height };
  }

  /** Move the cursor to a time, and show its values. */
  draw(time) {
    this.time = time;
    const shown = this.pointed ?? time, width = this.width() - LEFT - RIGHT;
    for (const { head, values, column, factor } of this.plots) {
      head.style.transform = `translateX(${Math.min(shown, this.until) / (this.until || 1) * width}px)`;
      this.game.players.forEach((track, place) => {
        const value = valueAt(this.game, track, column, shown) * factor;
        const text = Number.isNaN(value) ? "" : value.toFixed(Math.abs(value) < 99.95 ? 1 : 0).replace(/^-(?=[0.]+$)/, "").replace("-", "−");
        if (values[place].textContent !== text) values[place].textContent = text;
      });
    }
  }

  width() {
    return Math.max(this.element.clientWidth, LEFT + RIGHT + 40);
  }

  fit() {
    for (const { plot } of this.plots) {
      if (plot.width !== this.width()) plot.setSize({ width: this.width(), height: plot.height });
    }
    this.draw(this.time);
  }

  close() {
    this.observer.disconnect();
    repaint.delete(this.again);
    for (const { plot } of this.plots) plot.destroy();
  }
}
