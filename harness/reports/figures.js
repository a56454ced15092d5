// Links of figures: each names its game, for pointers (a tooltip) and for screen readers.

requestAnimationFrame(() => {
  for (const link of document.querySelectorAll('svg a[href^="#game="]')) {
    const game = games.get(normal(link.getAttribute("href").slice("#game=".length)));
    const words = game ? `${titleOf(game)}: ${OUTCOMES[game.outcome] ?? game.outcome}` : "a recorded game";
    link.setAttribute("aria-label", words);
    const title = document.createElementNS("http://www.w3.org/2000/svg", "title");
    title.textContent = words;
    link.prepend(title);
  }
});
