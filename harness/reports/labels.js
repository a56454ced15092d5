// The names beside the cars: each where it covers no other text and, if there is room near by, no player's car.

const LABEL = { halfY: 9, inset: 5, gap: 4, row: 17, near: 60 }; // pixels

/** The names of a game's players at a time: text, colour and car. The upper of several cars has its name above it. */
function namesOf(camera, game, time, named) {
  const cars = game.players.map(track => ({ track, pose: poseAt(game, track, time) })).filter(each => each.pose);
  cars.sort((a, b) => b.pose.y - a.pose.y);
  return cars.map(({ track, pose }, place) => ({ up: place === 0, ...named(track), car: carBox(camera, track, pose) }));
}

/** The names of the players, and whether they look. */
function playerNames(camera, game, time) {
  return namesOf(camera, game, time, track => {
    const lapsed = valueAt(game, track, "lapsed", time) > 0;
    return { text: nameOf(game, track) + (lapsed ? " · not looking" : ""), colour: lapsed ? palette.lapse : palette.ink };
  });
}

/** The names of a reference driver and of the people that go on. */
function referenceNames(camera, reference, time) {
  return namesOf(camera, reference, time, track => ({
    text: track.name === "ego" ? reference.driver : nameOf(reference, track),
    colour: referenceColour(track),
  }));
}

/** The names of the outlines of another game. */
function ghostNames(camera, game, time) {
  const ego = game.arm.split("_vs_")[0];
  return namesOf(camera, game, Math.min(time, game.duration), track => ({ text: `${nameOf(game, track)} (${ego})`, colour: palette.ink }));
}

/** Draw the names of the cars in the picture, those at the front first choosing their places; `taken` are boxes of other text. */
function drawNames(context, camera, everyone, taken = []) {
  context.font = `600 ${FONT}`;
  const picture = { x: camera.width / 2, y: camera.height / 2, halfX: camera.width / 2, halfY: camera.height / 2 };
  const names = everyone.filter(({ car }) => !areApart(car, picture)), boxes = [...taken], placed = [];
  for (const name of names) {
    const free = placesFor(camera, name, context.measureText(name.text).width / 2 + LABEL.inset)
      .filter(place => boxes.every(box => areApart(place, box)));
    const chosen = free.find(place => place.cost < LABEL.near && names.every(({ car }) => areApart(place, car))) ?? free[0];
    if (!chosen) continue; // the picture is full of text
    boxes.push(chosen);
    placed.push({ ...name, box: chosen });
  }
  for (const each of placed) drawLeader(context, each);
  for (const each of placed) drawLabel(context, each);
}

/** The box around a car in pixels: its middle, and half its width and height. */
function carBox(camera, track, { x, y, heading }) {
  const [cos, sin] = [Math.abs(Math.cos(heading)), Math.abs(Math.sin(heading))], [length, width] = track.size;
  const [across, up] = [cos * length + sin * width, sin * length + cos * width].map(metres => metres / 2 * camera.scale);
  const [middleX, middleY] = camera.place(x, y);
  return { x: middleX, y: middleY, halfX: across, halfY: up };
}

/** The places for a name in the picture, the best first: at its side of the car, at the other, beside it, further away. */
function placesFor(camera, { car, up }, halfX) {
  const { halfY, gap, row } = LABEL, places = [], side = up ? -1 : 1;
  const add = (x, y, cost) => {
    const inside = { x: within(x, halfX, camera.width - halfX), y: within(y, halfY, camera.height - halfY), halfX, halfY };
    places.push({ ...inside, cost: cost + Math.abs(inside.x - car.x) / 3 + Math.abs(inside.y - y) });
  };
  for (const across of [-1, 1]) add(car.x + across * (car.halfX + halfX + gap), car.y, row / 2);
  for (let away = 0; away < camera.height; away += row) {
    for (const way of [side, -side]) {
      const y = car.y + way * (car.halfY + halfY + gap + away);
      for (const across of [0, -1, 1, -2, 2]) add(car.x + across * halfX, y, away + (way === side ? 0 : row / 3));
    }
  }
  return places.sort((one, other) => one.cost - other.cost);
}

function within(value, low, high) {
  return Math.max(low, Math.min(value, high));
}

function areApart(one, other) {
  return Math.abs(one.x - other.x) >= one.halfX + other.halfX || Math.abs(one.y - other.y) >= one.halfY + other.halfY;
}

/** A line from a label that is not beside its car to the car. */
function drawLeader(context, { box, car, colour }) {
  const from = [within(car.x, box.x - box.halfX, box.x + box.halfX), within(car.y, box.y - box.halfY, box.y + box.halfY)];
  const to = [within(from[0], car.x - car.halfX, car.x + car.halfX), within(from[1], car.y - car.halfY, car.y + car.halfY)];
  if (Math.hypot(to[0] - from[0], to[1] - from[1]) < LABEL.row / 2) return;
  context.strokeStyle = colour;
  context.lineWidth = 1;
  context.beginPath();
  context.moveTo(...from);
  context.lineTo(...to);
  context.stroke();
}

function drawLabel(context, { text, colour, box }) {
  context.font = `600 ${FONT}`;
  context.textAlign = "center";
  context.textBaseline = "middle";
  context.fillStyle = palette.paper;
  context.globalAlpha = 0.82;
  context.beginPath();
  context.roundRect(box.x - box.halfX, box.y - box.halfY + 1, 2 * box.halfX, 2 * box.halfY - 2, 4);
  context.fill();
  context.globalAlpha = 1;
  context.fillStyle = colour;
  context.fillText(text, box.x, box.y);
}
