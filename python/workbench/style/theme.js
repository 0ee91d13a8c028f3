  const wanted = new URLSearchParams(location.search);
  if (!wanted.has("theme")) {
    const dark = matchMedia("(prefers-color-scheme: dark)").matches;
    wanted.set("theme", dark ? "dark" : "light");
    location.replace("?" + wanted);
  }
  document.documentElement.dataset.theme = wanted.get("theme") === "dark" ? "dark" : "light";
  function ehsidAddress(changes) {
    const address = new URLSearchParams(location.search);
    for (const [name, value] of Object.entries(changes)) {
      if (value === null) address.delete(name); else address.set(name, value);
    }
    return "?" + address;
  }
  function ehsidGoTo(changes) { location.assign(ehsidAddress(changes)); }
  function ehsidTheme() {
    const dark = document.documentElement.dataset.theme === "dark";
    ehsidGoTo({theme: dark ? "light" : "dark"});
  }
