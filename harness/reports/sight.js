// What a player can't see: the shadows of vans, buses and buildings, as the game computes lines of sight.

const SIGHT_M = 120, SHADOW_ALPHA = 0.16;

/** Shade what is hidden from a player, in its colour. */
function drawHidden(context, game, track, time) {
  const eye = poseAt(game, track, time);
  if (!eye) return;
  const shadows = new Path2D();
  for (const corners of hidersOf(game, track, time)) addShadow(shadows, eye, corners);
  context.fillStyle = colourOf(track);
  context.globalAlpha = SHADOW_ALPHA;
  context.fill(shadows);
  context.globalAlpha = 1;
}

/** The outlines of what hides: tall vehicles, obstacles that are higher than eyes, and each wall of a building. */
function* hidersOf(game, track, time) {
  for (const other of [...game.players, ...game.background]) {
    const hides = other.name.startsWith("obstacle_") ? ROAD.hidingObstacles.has(other.name) : other.size[1] >= ROAD.tallWidth;
    const pose = hides && other !== track ? poseAt(game, other, time) : null;
    if (pose) yield cornersOf(pose, other.size);
  }
  for (const outline of ROAD.walls) {
    for (let n = 0; n < outline.length; n++) yield [outline[n], outline[(n + 1) % outline.length]];
  }
}

function cornersOf({ x, y, heading }, [length, width]) {
  const [cos, sin] = [Math.cos(heading), Math.sin(heading)];
  return [[1, 1], [1, -1], [-1, -1], [-1, 1]].map(([along, across]) => {
    const [u, v] = [along * length / 2, across * width / 2];
    return [x + u * cos - v * sin, y + u * sin + v * cos];
  });
}

/** Add the shadow that an outline throws from an eye: between the lines past its outermost corners. */
function addShadow(path, eye, corners) {
  const middle = [0, 1].map(k => corners.reduce((sum, corner) => sum + corner[k], 0) / corners.length);
  const towards = Math.atan2(middle[1] - eye.y, middle[0] - eye.x);
  const turned = ([x, y]) => {
    const angle = Math.atan2(y - eye.y, x - eye.x) - towards;
    return Math.atan2(Math.sin(angle), Math.cos(angle));
  };
  const ordered = [...corners].sort((a, b) => turned(a) - turned(b));
  const [right, left] = [ordered[0], ordered[ordered.length - 1]];
  const far = ([x, y]) => {
    const distance = Math.hypot(x - eye.x, y - eye.y) || 1;
    return [eye.x + (x - eye.x) / distance * SIGHT_M, eye.y + (y - eye.y) / distance * SIGHT_M];
  };
  const outline = [right, far(right), far(left), left];
  outline.forEach(([x, y], place) => (place ? path.lineTo(x, y) : path.moveTo(x, y)));
  path.closePath();
}
