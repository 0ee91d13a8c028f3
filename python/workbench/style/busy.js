// A sign that a click was taken, from the click itself until the server has done what it asks for.
  addEventListener("click", (event) => {
    const pressed = event.composedPath().some((one) => one.matches?.("button.bk-btn:enabled"));
    const pulse = pressed && Bokeh.documents.flatMap((one) => [...one.all_models])
      .find((model) => model.tags.includes("PULSE"));
    if (!pulse) return;
    document.body.classList.add("busy");
    const beat = String(performance.now());
    const answered = () => {
      if (pulse.tags[1] !== beat) return;
      document.body.classList.remove("busy");
      pulse.properties.tags.change.disconnect(answered);
    };
    pulse.properties.tags.change.connect(answered);
    // Sent behind the click, so that it is answered behind it.
    setTimeout(() => { pulse.value = beat; });
  }, true);
