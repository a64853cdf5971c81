// The page in a cell of a notebook, by anywidget: in a frame of its own, its messages over the kernel.

const PAGE = "@page@";

export default {
  render({ model, el }) {
    const frame = document.createElement("iframe");
    frame.title = "Explore";
    frame.style.cssText = "width: 100%; height: 900px; border: 0";
    const hear = ({ source, data }) => {
      if (source === frame.contentWindow && typeof data === "string") model.send(data);
    };
    const tell = (_, [view]) => {
      const bytes = view.buffer.slice(view.byteOffset, view.byteOffset + view.byteLength);
      frame.contentWindow?.postMessage(bytes, "*");
    };
    addEventListener("message", hear);
    model.on("msg:custom", tell);
    frame.srcdoc = PAGE;
    el.append(frame);
    return () => {
      removeEventListener("message", hear);
      model.off("msg:custom", tell);
    };
  },
};
