// The switch of the home page between the replay and the one with the force network.
document.addEventListener("change", (event) => {
  if (event.target.id !== "forces") return;
  const hero = document.getElementById("hero");
  hero.src = event.target.checked ? hero.dataset.forces : hero.dataset.plain;
});
