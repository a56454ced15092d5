// The recorded games of the page: unpacked when they are first opened (harness/reports/embedding.py packs them).

const recorded = JSON.parse(document.getElementById("recorded").textContent);
const COLUMNS = ["x", "y", "heading", "speed", "acceleration", "steering", "lapsed", "gap", "time"];
const OFTEN_MISSING = new Set(["gap", "time"]);

/** The name of a game in addresses. */
function keyOf(game) {
  return `${encodeURIComponent(game.arm)},${game.seed},${game.episode}`;
}

// Python and browsers escape different characters: keys are compared in this form.
function normal(key) {
  const [, arm, seed, episode] = /^(.*),(-?\d+),(\d+)$/.exec(key) ?? [];
  try {
    return arm === undefined ? "" : keyOf({ arm: decodeURIComponent(arm), seed: Number(seed), episode: Number(episode) });
  } catch {
    return "";
  }
}

const games = new Map(recorded.games.map(game => [keyOf(game), game]));
// Games that `harness serve` sends when they are first opened; the page as a file knows none.
const elsewhere = JSON.parse(document.getElementById("elsewhere").textContent);
for (const [arm, persona, seed, episode, outcome, leastTime, cause, severity, deltaV] of elsewhere) {
  const game = {
    arm, persona, seed, episode, outcome, leastTime, cause, severity, deltaV,
    isElsewhere: true, players: [], background: [], touches: [], marks: [],
  };
  if (!games.has(keyOf(game))) games.set(keyOf(game), game);
}
const severalSeeds = new Set([...games.values()].map(game => game.seed)).size > 1;

async function fetched(game) {
  const answer = await fetch(`games/${keyOf(game)}.json`);
  if (!answer.ok) throw new Error(`the server has no game ${keyOf(game)}`);
  Object.assign(game, await answer.json());
}

/** A promise of the game with the unpacked columns of its tracks. */
function opened(game) {
  game.promise ??= (game.isElsewhere ? fetched(game) : Promise.resolve()).then(() => inflate(game.packed)).then(numbers => {
    let at = 0;
    const columns = (track, names) => {
      for (const [place, name] of names.entries()) {
        track[name] = column(numbers.subarray(at, at + track.count), ...recorded.columns[place], OFTEN_MISSING.has(name));
        at += track.count;
      }
    };
    for (const track of game.players) columns(track, COLUMNS);
    for (const track of game.background) columns(track, COLUMNS.slice(0, recorded.backgroundColumns));
    if (game.reference) whatIf(game, track => columns(track, COLUMNS.slice(0, recorded.referenceColumns)));
    game.duration = game.steps * game.step;
    game.touches = game.touches.map(([time, x, y]) => ({ time, x, y }));
    game.packed = null;
    return game;
  });
  return game.promise;
}

/** Read the tracks of a reference driver that prevents the collision, a game of its own with the same clock. */
function whatIf(game, read) {
  const { reference, step, persona } = game;
  reference.players.forEach(read);
  const steps = Math.max(...reference.players.map(track => track.first + track.count - 1));
  Object.assign(reference, { step, steps, persona, duration: steps * step });
}

/** The bytes of deflated bytes in base64. */
async function inflated(text) {
  const packed = Uint8Array.from(atob(text), character => character.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** Base64 of deflated variable-length integers (zigzag, 7 bits a byte, low bits first), as numbers. */
async function inflate(text) {
  const bytes = await inflated(text);
  const numbers = new Int32Array(bytes.length);
  let count = 0, number = 0, shift = 0;
  for (const byte of bytes) {
    number |= (byte & 127) << shift;
    shift += 7;
    if (byte < 128) {
      numbers[count++] = (number >>> 1) ^ -(number & 1);
      number = shift = 0;
    }
  }
  return numbers.subarray(0, count);
}

/** The values of a column from the differences of its whole numbers; a missing value is NaN. */
function column(differences, unit, times, mayMiss) {
  let whole = Array.from(differences);
  for (let time = 0; time < times; time++) {
    let sum = 0;
    whole = whole.map(difference => (sum += difference));
  }
  return Float64Array.from(whole, value => (mayMiss && value < 0 ? NaN : value * unit));
}

/** The pose of a road user at a time, interpolated between the steps; null when it is absent. */
function poseAt(game, track, time) {
  let place = Math.min(Math.max(time, 0), game.duration) / game.step - track.first;
  if (Math.abs(place - Math.round(place)) < 1e-6) place = Math.round(place);
  if (place < 0 || place > track.count - 1) return null;
  const low = Math.floor(place), share = place - low, high = Math.min(low + 1, track.count - 1);
  const turn = track.heading[high] - track.heading[low];
  return {
    x: track.x[low] + share * (track.x[high] - track.x[low]),
    y: track.y[low] + share * (track.y[high] - track.y[low]),
    heading: track.heading[low] + share * Math.atan2(Math.sin(turn), Math.cos(turn)),
  };
}

/** The step of a track that is shown at a time; null when the road user is absent. */
function stepAt(game, track, time) {
  const step = Math.floor(Math.min(time, game.duration) / game.step + 1e-6) - track.first;
  return step < 0 || step >= track.count ? null : step;
}

/** A track's value at a time; NaN when there is none. */
function valueAt(game, track, name, time) {
  const step = stepAt(game, track, time);
  return step === null ? NaN : track[name][step];
}

/** The time of the last contact, else that at which the ego is nearest to another player; the end without one. */
function momentOf(game) {
  if (game.touches.length) return game.touches[game.touches.length - 1].time;
  const ego = game.players.find(track => track.name === "ego");
  let moment = game.duration, least = Infinity;
  for (const other of ego ? game.players.filter(track => track !== ego) : []) {
    const from = Math.max(ego.first, other.first), to = Math.min(ego.first + ego.count, other.first + other.count);
    for (let step = from; step < to; step++) {
      const [own, its] = [step - ego.first, step - other.first];
      const away = Math.hypot(ego.x[own] - other.x[its], ego.y[own] - other.y[its]);
      if (away < least) [least, moment] = [away, step * game.step];
    }
  }
  return moment;
}

const OUTCOMES = { goal: "goal reached", rail: "rail contact", collision: "collision", timeout: "out of time", "": "still driving" };

function nameOf(game, track) {
  if (track.name === "ego") return "ego";
  const place = track.name.match(/\d+$/)?.[0];  // among several people
  return (track.persona || game.persona || "non-ego") + (place ? ` ${place}` : "");
}

/** A game in words. */
function titleOf(game) {
  return `${game.arm}, ${severalSeeds ? `seed ${game.seed}, ` : ""}game ${game.episode}`;
}

/** How a game ended, and how severe the collision was. */
function outcomeOf(game) {
  return (OUTCOMES[game.outcome] ?? game.outcome) + (game.deltaV === null ? "" : `, delta-v ${game.deltaV.toFixed(1)} m/s`);
}

/** The same episode with the other ego; undefined when the page does not contain it. */
function counterpartOf(game) {
  const others = { naive: ["retrained", "reconfigured"], retrained: ["naive"], reconfigured: ["naive"] };
  const ego = game.arm.match(/^(naive|retrained|reconfigured)(?=_vs_)/)?.[1];
  const arms = (others[ego] ?? []).map(other => other + game.arm.slice(ego.length));
  return arms.map(arm => games.get(keyOf({ ...game, arm }))).find(found => found !== undefined);
}
