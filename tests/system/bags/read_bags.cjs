// The messages of bags by the formats' own readers, one a line: topic and content in hex.
//   read_bags.cjs FILE      FILE ends in .bag or .mcap
const fs = require("fs");

async function readRosbag(path) {
  const { Bag } = require("@foxglove/rosbag");
  const { FileReader } = require("@foxglove/rosbag/node");
  const bag = new Bag(new FileReader(path), { parse: false });
  await bag.open();
  for await (const message of bag.messageIterator()) print(message.topic, message.data);
}

async function readMcap(path) {
  const { McapStreamReader } = require("@mcap/core");
  const reader = new McapStreamReader();
  reader.append(fs.readFileSync(path));
  const topics = new Map();
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Channel") topics.set(record.id, record.topic);
    if (record.type === "Message") print(topics.get(record.channelId), record.data);
  }
  if (!reader.done()) throw new Error("the file does not end");
}

function print(topic, data) {
  console.log(topic + " " + Buffer.from(data).toString("hex"));
}

const path = process.argv[2];
(path.endsWith(".bag") ? readRosbag(path) : readMcap(path)).catch((error) => {
  console.error(error);
  process.exit(1);
});
