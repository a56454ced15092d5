// The curves under a game: speed, acceleration, steering, gap and time to collision of both players, over its time.

const STRIPS = [
  { name: "speed", unit: "m/s", column: "speed", from: 0 },
  { name: "acceleration", unit: "m/s²", column: "acceleration", from: -1, to: 1 },
  { name: "steering", unit: "°", column: "steering", factor: 180 / Math.PI, from: -2, to: 2 },
  { name: "gap ahead", unit: "m", column: "gap", from: 0, most: 60 },
  { name: "time to collision", unit: "s", column: "time", from: 0, most: 10 },
];
const ROW = 58, LANE = 15, AXIS = 18, LEFT = 34, RIGHT = 10;

/** The range of each strip over some games, so that games side by side have the same axes. */
function rangesOf(shown) {
  return STRIPS.map(({ column, factor = 1, from = 0, to = 0.1, most = Infinity }) => {
    let [low, high] = [from, to];
    for (const game of shown) {
      for (const track of game.players) {
        for (const value of track[column]) {
          if (Number.isNaN(value)) continue;
          low = Math.min(low, value * factor);
          high = Math.max(high, Math.min(value * factor, most));
        }
      }
    }
    return [low, high + 0.04 * (high - low)];
  });
}

class Strips {
  constructor(canvas, game, seek) {
    this.game = game;
    this.time = 0;
    this.ranges = rangesOf([game]);
    this.until = game.duration;
    this.lanes = game.players.filter(track => game.marks.some(mark => mark.player === track.name));
    this.top = this.lanes.length * LANE + 4;
    canvas.style.height = `${this.top + STRIPS.length * ROW + AXIS}px`;
    this.still = document.createElement("canvas");
    this.sheet = new Sheet(canvas, () => { this.drawStill(); this.draw(this.time); });
    this.onDrag(canvas, seek);
  }

  /** Dragging over the curves moves through time. */
  onDrag(canvas, seek) {
    const at = event => {
      const { left } = canvas.getBoundingClientRect();
      const share = (event.clientX - left - LEFT) / (this.sheet.width - LEFT - RIGHT);
      seek(Math.min(Math.max(share, 0), 1) * this.until);
    };
    canvas.addEventListener("pointerdown", event => { canvas.setPointerCapture(event.pointerId); at(event); });
    canvas.addEventListener("pointermove", event => event.buttons & 1 && canvas.hasPointerCapture(event.pointerId) && at(event));
  }

  /** Use the axes of all games that are shown. */
  align(ranges, until) {
    Object.assign(this, { ranges, until });
    this.sheet.again();
  }

  x(time) {
    return LEFT + time / (this.until || 1) * (this.sheet.width - LEFT - RIGHT);
  }

  y(row, value) {
    const [low, high] = this.ranges[row], top = this.top + row * ROW + 15, bottom = this.top + (row + 1) * ROW - 4;
    return bottom - (Math.min(Math.max(value, low), high) - low) / (high - low) * (bottom - top);
  }

  /** Draw everything except the cursor to a canvas of its own. */
  drawStill() {
    const { width, height, ratio } = this.sheet;
    Object.assign(this.still, { width: Math.max(1, Math.round(width * ratio)), height: Math.max(1, Math.round(height * ratio)) });
    const context = this.still.getContext("2d");
    context.scale(ratio, ratio);
    context.font = FONT;
    this.drawMarks(context);
    STRIPS.forEach((strip, row) => this.drawStrip(context, strip, row, width));
    this.drawAxis(context, width);
    for (const touch of this.game.touches) {
      context.strokeStyle = palette.contact;
      context.lineWidth = 1.5;
      context.setLineDash([4, 3]);
      context.beginPath();
      context.moveTo(this.x(touch.time), this.top);
      context.lineTo(this.x(touch.time), this.top + STRIPS.length * ROW);
      context.stroke();
      context.setLineDash([]);
    }
  }

  /** What the players did, a line for each of them. */
  drawMarks(context) {
    context.textAlign = "left";
    context.textBaseline = "middle";
    this.lanes.forEach((track, lane) => {
      const y = lane * LANE + LANE / 2;
      let free = -Infinity;
      for (const mark of this.game.marks) {
        if (mark.player !== track.name) continue;
        const [from, to] = [this.x(mark.from), Math.max(this.x(mark.until), this.x(mark.from) + 3)];
        context.fillStyle = colourOf(track);
        context.globalAlpha = 0.35;
        context.fillRect(from, y - 6, to - from, 12);
        context.globalAlpha = 1;
        context.fillRect(from, y - 6, 2, 12);
        const wide = context.measureText(mark.name).width;
        const at = from + 5 + wide > this.sheet.width ? from - wide - 3 : from + 5;
        if (at > free) {
          context.fillStyle = palette.ink;
          context.fillText(mark.name, at, y);
          free = at + wide;
        }
      }
    });
  }

  drawStrip(context, { name, unit, column, factor = 1 }, row, width) {
    const [low, high] = this.ranges[row], [top, bottom] = [this.y(row, high), this.y(row, low)];
    this.drawLapses(context, top, bottom);
    context.strokeStyle = palette.grid;
    context.lineWidth = 1;
    context.fillStyle = palette.faint;
    context.textAlign = "right";
    context.textBaseline = "middle";
    for (const value of ticks(low, high)) {
      const y = Math.round(this.y(row, value)) + 0.5;
      context.beginPath();
      context.moveTo(LEFT, y);
      context.lineTo(width - RIGHT, y);
      context.stroke();
      context.fillText(String(value).replace("-", "−"), LEFT - 5, y);
    }
    context.textAlign = "left";
    context.textBaseline = "alphabetic";
    context.fillText(`${name} (${unit})`, LEFT + 2, top - 3);
    for (const track of [...this.game.players].reverse()) {
      context.strokeStyle = colourOf(track);
      context.lineWidth = 1.8;
      context.lineJoin = "round";
      context.beginPath();
      let drawing = false;
      track[column].forEach((value, step) => {
        if (Number.isNaN(value)) {
          drawing = false;
          return;
        }
        const [x, y] = [this.x((track.first + step) * this.game.step), this.y(row, value * factor)];
        if (drawing) context.lineTo(x, y);
        else context.moveTo(x, y);
        drawing = true;
      });
      context.stroke();
    }
  }

  drawLapses(context, top, bottom) {
    context.fillStyle = palette.lapse;
    context.globalAlpha = 0.16;
    for (const track of this.game.players) {
      for (let step = 0; step < track.count; step++) {
        if (!track.lapsed[step]) continue;
        const begun = step;
        while (track.lapsed[step + 1]) step++;
        const [from, to] = [begun - 1, step].map(each => this.x(Math.max(track.first + each, 0) * this.game.step));
        context.fillRect(from, top, to - from, bottom - top);
      }
    }
    context.globalAlpha = 1;
  }

  drawAxis(context, width) {
    const y = this.top + STRIPS.length * ROW + 4;
    context.fillStyle = palette.faint;
    context.textBaseline = "top";
    const each = [0.5, 1, 2, 5, 10, 20, 50].find(step => this.until / step <= (width - LEFT) / 45) ?? 100;
    for (let time = 0; time <= this.until + 1e-9; time += each) {
      context.textAlign = time === 0 ? "left" : "center";
      context.fillText(`${time} s`, this.x(time), y);
    }
  }

  /** The curves, with the cursor at a time. */
  draw(time) {
    this.time = time;
    const { context, canvas, width, ratio } = this.sheet;
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    context.drawImage(this.still, 0, 0);
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    const x = this.x(Math.min(time, this.until));
    context.fillStyle = palette.ink;
    context.fillRect(x - 0.75, 0, 1.5, this.top + STRIPS.length * ROW);
    for (const [row, { column, factor = 1 }] of STRIPS.entries()) {
      this.game.players.forEach((track, place) => {
        const value = valueAt(this.game, track, column, time) * factor;
        if (Number.isNaN(value)) return;
        context.fillStyle = colourOf(track);
        context.beginPath();
        context.arc(x, this.y(row, value), 3.2, 0, 7);
        context.fill();
        context.font = `600 ${FONT}`;
        context.textAlign = "right";
        context.textBaseline = "alphabetic";
        const text = value.toFixed(Math.abs(value) < 99.95 ? 1 : 0).replace("-", "−");
        const at = [width - RIGHT - place * 42, this.top + row * ROW + 12];
        context.strokeStyle = palette.paper;
        context.lineWidth = 4;
        context.strokeText(text, ...at);
        context.fillText(text, ...at);
      });
    }
  }

  close() {
    this.sheet.close();
  }
}

/** Two or three round values of an axis. */
function ticks(low, high) {
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100].find(each => (high - low) / each <= 2.6) ?? 200;
  const found = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9; n++) found.push(Math.round(n * step * 10) / 10 || 0);
  return found;
}
