// The moving parts of the road: road users as oriented boxes with heading, trails, lapses and contacts.

const TRAIL_S = 4, GHOSTS_S = 1, BURST_S = 0.35;

/** Draw a game at a time, from bottom to top: trails, background traffic, players, contacts. */
function drawGame(context, camera, ratio, game, time) {
  camera.inMetres(context, ratio, () => {
    for (const track of game.players) drawHidden(context, game, track, time);
    for (const track of game.players) drawTrail(context, camera, game, track, time);
    for (const track of game.background) {
      const pose = poseAt(game, track, time);
      if (pose) drawBody(context, camera, track, pose, { colour: palette.other, stands: track.name.startsWith("obstacle_") });
    }
    for (const track of [...game.players].reverse()) {
      const pose = poseAt(game, track, time), step = stepAt(game, track, time);
      if (pose && step !== null) drawBody(context, camera, track, pose, lookOf(game, track, step, time));
    }
    for (const touch of game.touches) {
      if (time >= touch.time - 1e-6) drawBurst(context, camera, touch, time - touch.time);
    }
  });
}

/** Draw the players of another game of the same start as outlines; `filled` where no second road shows them. */
function drawGhost(context, camera, ratio, game, time, filled) {
  camera.inMetres(context, ratio, () => {
    for (const track of game.players) {
      const pose = poseAt(game, track, Math.min(time, game.duration));
      if (pose) drawOutline(context, camera, track, pose, colourOf(track), filled);
    }
  });
}

/** A car as a dashed outline. */
function drawOutline(context, camera, track, pose, colour, filled) {
  context.save();
  context.translate(pose.x, pose.y);
  context.rotate(pose.heading);
  context.setLineDash([0.5, 0.35]);
  context.lineWidth = Math.max(0.16, 1.5 / camera.scale);
  context.strokeStyle = context.fillStyle = colour;
  box(context, ...track.size, 0.4);
  context.globalAlpha = 0.3;
  if (filled) context.fill();
  context.globalAlpha = 1;
  context.stroke();
  context.restore();
}

/** Draw the ego as a reference driver drives it, and the people that go on, as outlines. */
function drawReference(context, camera, ratio, reference, time) {
  camera.inMetres(context, ratio, () => {
    for (const track of reference.players) {
      const pose = poseAt(reference, track, time);
      if (pose) drawOutline(context, camera, track, pose, referenceColour(track), true);
    }
  });
}

function referenceColour(track) {
  return track.name === "ego" ? palette.mended : palette["non-ego"];
}

function colourOf(track) {
  return palette[track.name === "ego" ? "ego" : "non-ego"];
}

/** The look of a player's car: brake lights, front wheels, a contact, a lapse. */
function lookOf(game, track, step, time) {
  const hit = ["collision", "rail"].includes(track.outcome) && time >= track.ended * game.step - 1e-6;
  return {
    colour: colourOf(track),
    brakes: track.acceleration[step] < -0.5,
    wheels: track.steering[step],
    lapsed: track.lapsed[step] > 0,
    touched: hit,
  };
}

function box(context, length, width, round) {
  context.beginPath();
  context.roundRect(-length / 2, -width / 2, length, width, round);
}

/** The outline of a person on foot. */
function disc(context, length, width) {
  context.beginPath();
  context.ellipse(0, 0, length / 2, width / 2, 0, 0, 2 * Math.PI);
}

function drawBody(context, camera, track, pose, look) {
  const [length, width] = track.size, thin = 1 / camera.scale, fine = camera.scale > 5;
  context.save();
  context.translate(pose.x, pose.y);
  context.rotate(pose.heading);
  if (look.lapsed) {
    context.strokeStyle = palette.lapse;
    context.lineWidth = Math.max(0.22, 2 * thin);
    context.setLineDash([0.7, 0.5]);
    box(context, length + 1.3, width + 1.3, 1.2);
    context.stroke();
    context.setLineDash([]);
  }
  if (fine && length > 3 && !look.stands) {
    context.fillStyle = "#15181c";
    for (const [x, side, turn] of [[0.3, 1, look.wheels], [0.3, -1, look.wheels], [-0.3, 1, 0], [-0.3, -1, 0]]) {
      context.save();
      context.translate(x * length, side * (width / 2 - 0.1));
      context.rotate(turn ?? 0);
      context.fillRect(-0.34, -0.16, 0.68, 0.32);
      context.restore();
    }
  }
  const onFoot = length < 1;
  if (onFoot) disc(context, length, width);
  else box(context, length, width, Math.min(0.45, width / 4));
  context.fillStyle = look.colour;
  context.fill();
  context.lineWidth = Math.max(0.07, thin);
  context.strokeStyle = look.touched ? palette.contact : "#0009";
  if (look.touched) context.lineWidth = Math.max(0.2, 2 * thin);
  context.stroke();
  if (fine && length > 3 && !look.stands) drawGlass(context, length, width);
  if (!look.stands) drawHeading(context, length, width);
  if (look.brakes && !onFoot) {
    context.fillStyle = "#ff2a1f";
    for (const side of [1, -1]) context.fillRect(-length / 2 - 0.05, side * width * 0.36 - 0.22, Math.max(0.24, 2 * thin), 0.44);
  }
  context.restore();
}

function drawGlass(context, length, width) {
  context.fillStyle = "#10161dc0";
  for (const [back, front, narrow, wide] of [[0.1, 0.22, 0.36, 0.42], [-0.34, -0.26, 0.4, 0.34]]) {
    context.beginPath();
    context.moveTo(back * length, -narrow * width);
    context.lineTo(front * length, -wide * width);
    context.lineTo(front * length, wide * width);
    context.lineTo(back * length, narrow * width);
    context.fill();
  }
}

/** A white arrowhead at the front. */
function drawHeading(context, length, width) {
  context.fillStyle = "#fff";
  context.beginPath();
  context.moveTo(0.47 * length, 0);
  context.lineTo(0.29 * length, 0.26 * width);
  context.lineTo(0.29 * length, -0.26 * width);
  context.fill();
}

/** The last seconds of a player's path: a line, thick in lapses of attention, and outlines each second. */
function drawTrail(context, camera, game, track, time) {
  const now = Math.min(Math.floor(time / game.step + 1e-6) - track.first, track.count - 1);
  const from = Math.max(0, Math.floor(now - TRAIL_S / game.step)), thin = 1 / camera.scale;
  const pose = poseAt(game, track, time);
  for (const lapsed of [true, false]) {
    context.strokeStyle = lapsed ? palette.lapse : colourOf(track);
    context.lineWidth = lapsed ? Math.max(0.55, 4 * thin) : Math.max(0.16, 1.5 * thin);
    for (let step = from; step < now; step++) {
      if (lapsed && !track.lapsed[step + 1]) continue;
      context.globalAlpha = (lapsed ? 0.7 : 0.9) * (step - from + 1) / (now - from);
      context.beginPath();
      context.moveTo(track.x[step], track.y[step]);
      context.lineTo(track.x[step + 1], track.y[step + 1]);
      context.stroke();
    }
  }
  if (pose && now >= 0) {
    context.globalAlpha = 0.9;
    context.beginPath();
    context.moveTo(track.x[now], track.y[now]);
    context.lineTo(pose.x, pose.y);
    context.stroke();
  }
  context.lineWidth = Math.max(0.08, thin);
  const each = Math.max(1, Math.round(GHOSTS_S / game.step));
  for (let step = now - (now + track.first) % each; step >= from; step -= each) {
    if (step === now && pose) continue;
    context.globalAlpha = 0.5 * (step - from + 1) / (now - from + 1);
    context.save();
    context.translate(track.x[step], track.y[step]);
    context.rotate(track.heading[step]);
    box(context, ...track.size, 0.45);
    context.stroke();
    context.restore();
  }
  context.globalAlpha = 1;
}

/** A contact: a star that starts large and stays. */
function drawBurst(context, camera, touch, since) {
  const grown = stillMotion.matches ? 1 : 1 + 0.6 * Math.max(0, 1 - since / BURST_S);
  const far = Math.max(2.1, 15 / camera.scale) * grown, near = Math.max(1.3, 9 / camera.scale) * grown;
  context.lineWidth = Math.max(0.24, 2 / camera.scale);
  context.strokeStyle = palette.contact;
  context.beginPath();
  for (let n = 0; n < 12; n++) {
    const angle = n * Math.PI / 6;
    context.moveTo(touch.x + near * Math.cos(angle), touch.y + near * Math.sin(angle));
    context.lineTo(touch.x + far * Math.cos(angle), touch.y + far * Math.sin(angle));
  }
  context.stroke();
}
