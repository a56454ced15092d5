// The road from above, to scale, on a canvas: the camera and the parts that do not move.

const stillMotion = matchMedia("(prefers-reduced-motion: reduce)");
const palette = {};
const repaint = new Set();

/** The page's colours, for canvases. */
function readPalette() {
  const style = getComputedStyle(document.documentElement);
  for (const name of ["paper", "ink", "faint", "grid", "ego", "non-ego", "other", "asphalt", "verge", "mark",
    "rail", "goal", "lapse", "contact", "mended"]) {
    palette[name] = style.getPropertyValue(`--${name}`).trim();
  }
}
readPalette();
for (const query of ["(prefers-color-scheme: dark)", "print"]) {
  matchMedia(query).addEventListener("change", () => {
    readPalette();
    for (const paint of repaint) paint();
  });
}

/** A canvas with the screen's resolution; `paint` draws it in CSS pixels when its size or the page's colours change. */
class Sheet {
  constructor(canvas, paint) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.paint = paint;
    this.observer = new ResizeObserver(() => this.fit() && this.again());
    this.observer.observe(canvas);
    this.again = () => this.width && this.paint();
    repaint.add(this.again);
    this.fit();
  }

  /** Take the size of the canvas in the page; returns whether it has changed. */
  fit() {
    const { width, height } = this.canvas.getBoundingClientRect();
    const ratio = window.devicePixelRatio || 1;
    if (width === this.width && height === this.height && ratio === this.ratio) return false;
    Object.assign(this, { width, height, ratio });
    this.canvas.width = Math.round(width * ratio);
    this.canvas.height = Math.round(height * ratio);
    return true;
  }

  close() {
    this.observer.disconnect();
    repaint.delete(this.again);
  }
}

const ROAD = (() => {
  const scene = recorded.scene ?? { surfaces: [], laneMarks: [], edgeLines: [], rails: [], goal: [] };
  const points = scene.surfaces.flat(2);
  const path = lines => {
    const drawn = new Path2D();
    for (const line of lines) line.forEach(([x, y], place) => (place ? drawn.lineTo(x, y) : drawn.moveTo(x, y)));
    return drawn;
  };
  const [xs, ys] = [points.map(point => point[0]), points.map(point => point[1])];
  const most = (values, choose, start) => values.reduce((best, value) => choose(best, value), start);
  return {
    surface: path(scene.surfaces.flat()),
    marks: path(scene.laneMarks),
    edges: path(scene.edgeLines),
    rails: path(scene.rails),
    goal: scene.goal,
    stripes: path(scene.stripes ?? []),
    walls: scene.buildings ?? [],
    hidingObstacles: new Set(scene.hidingObstacles ?? []),
    tallWidth: scene.tallWidth ?? Infinity,
    buildings: path((scene.buildings ?? []).map(outline => [...outline, outline[0]])),
    left: most(xs, Math.min, Infinity), right: most(xs, Math.max, -Infinity),
    bottom: most(ys, Math.min, Infinity), top: most(ys, Math.max, -Infinity),
  };
})();

/** A camera: the point in its centre, and its pixels per metre. */
class Camera {
  constructor(widest) {
    this.widest = widest; // visible width in metres, when the players are near each other
    this.follows = true;
    this.reset();
  }

  reset() {
    this.zoom = 1;
    this.moved = { x: 0, y: 0 };
  }

  /** Look at games at a time, on a canvas of that size. It depends on the time alone, so that dragging and playing show the same. */
  look(games, time, width, height) {
    Object.assign(this, { width, height });
    if (!this.follows) {
      const [wide, high] = [ROAD.right - ROAD.left + 8, ROAD.top - ROAD.bottom + 8];
      this.x = (ROAD.left + ROAD.right) / 2;
      this.y = (ROAD.bottom + ROAD.top) / 2;
      this.scale = Math.min(width / wide, height / high);
    } else {
      const seen = games.flatMap(game => game.players.map(track => this.seen(game, track, Math.min(time, game.duration))))
        .filter(each => each.weight > 0);
      const total = seen.reduce((sum, each) => sum + each.weight, 0);
      this.x = seen.reduce((sum, each) => sum + each.weight * each.x, 0) / total;
      this.y = seen.reduce((sum, each) => sum + each.weight * each.y, 0) / total;
      const apart = { x: 0, y: 0 };
      for (const each of seen) {
        apart.x = Math.max(apart.x, 2 * each.weight * Math.abs(each.x - this.x));
        apart.y = Math.max(apart.y, 2 * each.weight * Math.abs(each.y - this.y));
      }
      this.scale = Math.min(width / Math.max(this.widest, apart.x + 16), height / Math.max(14, apart.y + 9));
    }
    this.scale *= this.zoom;
    this.x += this.moved.x;
    this.y += this.moved.y;
  }

  /** The weight of a player that has left falls to 0 within a second, so that the view does not jump. */
  seen(game, track, time) {
    const last = (track.first + track.count - 1) * game.step;
    const { x, y } = poseAt(game, track, Math.min(time, last));
    return { x, y, weight: track.count + track.first > game.steps ? 1 : Math.max(0, Math.min(1, 1 - (time - last))) || 1e-6 };
  }

  /** Pixels of a point. */
  place(x, y) {
    return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale];
  }

  /** Draw in metres, y up. */
  inMetres(context, ratio, draw) {
    const scale = this.scale * ratio;
    context.save();
    context.setTransform(scale, 0, 0, -scale, (this.width / 2 - this.x * this.scale) * ratio,
      (this.height / 2 + this.y * this.scale) * ratio);
    draw();
    context.restore();
  }
}

/** The road, its marks and rails, and the goal. */
function drawRoad(context, camera, ratio) {
  const thin = pixels => pixels / camera.scale;
  context.fillStyle = palette.verge;
  context.fillRect(0, 0, camera.width, camera.height);
  camera.inMetres(context, ratio, () => {
    context.fillStyle = palette.asphalt;
    context.fill(ROAD.surface, "evenodd");
    context.fillStyle = palette.mark;
    context.fill(ROAD.stripes);
    drawBuildings(context, thin(2));
    context.strokeStyle = palette.mark;
    context.lineWidth = Math.max(0.13, thin(1));
    context.setLineDash([3, 3]);
    context.stroke(ROAD.marks);
    context.setLineDash([]);
    context.stroke(ROAD.edges);
    context.lineJoin = "round";
    for (const [colour, width] of [[palette.verge, 0.75], [palette.rail, 0.34]]) {
      context.strokeStyle = colour;
      context.lineWidth = Math.max(width, thin(width * 4));
      context.stroke(ROAD.rails);
    }
    drawGoal(context);
  });
}

/** Buildings, and walls without extent. */
function drawBuildings(context, width) {
  context.fillStyle = context.strokeStyle = palette.rail;
  context.globalAlpha = 0.45;
  context.fill(ROAD.buildings);
  context.globalAlpha = 1;
  context.lineWidth = Math.max(0.3, width);
  context.stroke(ROAD.buildings);
}

/** The goal as a chequered band across the lanes. */
function drawGoal(context) {
  for (const [[x, y], [toX, toY]] of ROAD.goal) {
    const [dx, dy] = [toX - x, toY - y], long = Math.hypot(dx, dy), count = Math.max(2, Math.round(long / 0.8));
    context.fillStyle = palette.goal;
    for (let n = 0; n < count; n++) {
      const side = n % 2 ? 0 : -0.5, [ax, ay] = [x + dx * n / count, y + dy * n / count];
      const [ux, uy] = [dy / long, -dx / long]; // the direction of traffic
      context.beginPath();
      context.moveTo(ax + ux * side, ay + uy * side);
      context.lineTo(ax + ux * (side + 0.5), ay + uy * (side + 0.5));
      context.lineTo(ax + ux * (side + 0.5) + dx / count, ay + uy * (side + 0.5) + dy / count);
      context.lineTo(ax + ux * side + dx / count, ay + uy * side + dy / count);
      context.fill();
    }
  }
}

/** A bar with a length of a round number of metres. Returns the box of it and its text. */
function drawScaleBar(context, camera) {
  const metres = [1, 2, 5, 10, 20, 50, 100, 200].find(each => each * camera.scale >= 50) ?? 500;
  const [long, x, y] = [metres * camera.scale, 12, camera.height - 10];
  context.strokeStyle = context.fillStyle = palette.ink;
  context.lineWidth = 1.5;
  context.beginPath();
  context.moveTo(x, y - 4);
  context.lineTo(x, y);
  context.lineTo(x + long, y);
  context.lineTo(x + long, y - 4);
  context.stroke();
  context.font = FONT;
  context.textAlign = "left";
  context.textBaseline = "bottom";
  context.fillText(`${metres} m`, x + 4, y - 3);
  return { x: x + long / 2, y: y - 8, halfX: long / 2 + 3, halfY: 11 };
}

const FONT = "11px system-ui, sans-serif";
