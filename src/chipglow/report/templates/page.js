"use strict";
const unfold = () => {
  const target = document.getElementById(location.hash.slice(1));
  for (let one = target; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  target?.querySelector("details")?.setAttribute("open", "");
  target?.scrollIntoView();
};
addEventListener("hashchange", unfold);
if (location.hash) unfold();
