// Joins the module of the lab to the WebSocket of the server, in the form in which anywidget gives a model to it.
import lab from "./lab.js";

const at = new URL("socket", location.href);
at.protocol = "ws:";

function connect(listen) {
  const socket = new WebSocket(at);
  socket.binaryType = "arraybuffer";
  socket.onmessage = ({ data }) => {
    const length = new DataView(data).getUint32(0, true);
    const content = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    listen(content, [new DataView(data, 4 + length)]);
  };
  return socket;
}

let listener = () => {};
let socket;
const hear = (content, buffers) => listener(content, buffers);
function open() {
  socket = connect(hear);
  socket.onclose = () => hear({ kind: "closed" }, []);
}
const model = {
  send(content) {
    if (content.kind === "open") open(); // the server answers with the choices and the first frame
    else if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(content));
  },
  on(name, what) { listener = what; },
  off() { listener = () => {}; },
};
lab.render({ model, el: document.getElementById("lab"), whole: true });
