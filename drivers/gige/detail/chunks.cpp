#include "drivers/gige/detail/chunks.hpp"

#include <bit>

namespace vergence::gige {
namespace {

constexpr std::size_t kTag = 8;  // bytes behind a chunk: its number, its length
constexpr int kMostChunks =
    64;  // empty ones cost eight bytes each: their number must not be the frame's to choose
constexpr int kLongestChain = 4;                    // from a feature to its register
constexpr double kShortest = 1e-3, kLongest = 6e7;  // µs

std::uint32_t word_at(std::span<const std::uint8_t> bytes, std::size_t at) noexcept {
  return static_cast<std::uint32_t>(bytes[at]) << 24U |
         static_cast<std::uint32_t>(bytes[at + 1]) << 16U |
         static_cast<std::uint32_t>(bytes[at + 2]) << 8U | bytes[at + 3];
}

/// Empty: not there.
std::span<const std::uint8_t> find_chunk(std::span<const std::uint8_t> tail,
                                         std::uint32_t id) noexcept {
  for (int i = 0; i < kMostChunks && tail.size() >= kTag; ++i) {
    const std::size_t end = tail.size() - kTag;
    const std::uint32_t length = word_at(tail, end + 4);
    if (length > end) return {};  // the pixels, or no chunk
    if (word_at(tail, end) == id) return tail.subspan(end - length, length);
    tail = tail.first(end - length);
  }
  return {};
}

/// Precondition: the field's bytes, at most eight.
double number_in(std::span<const std::uint8_t> bytes, const ChunkField& field) noexcept {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i)
    value = value << 8U | bytes[field.big_endian ? i : bytes.size() - 1 - i];
  if (!field.real) return static_cast<double>(value);
  return bytes.size() == 8
             ? std::bit_cast<double>(value)
             : static_cast<double>(std::bit_cast<float>(static_cast<std::uint32_t>(value)));
}

/// The node that a feature's property points to; null: it has no such property.
ArvGcNode* linked(ArvGcNode* node, ArvGcPropertyNodeType type) {
  for (ArvDomNode* child = arv_dom_node_get_first_child(ARV_DOM_NODE(node)); child != nullptr;
       child = arv_dom_node_get_next_sibling(child))
    if (ARV_IS_GC_PROPERTY_NODE(child) &&
        arv_gc_property_node_get_node_type(ARV_GC_PROPERTY_NODE(child)) == type)
      return arv_gc_property_node_get_linked_node(ARV_GC_PROPERTY_NODE(child));
  return nullptr;
}
ArvGcPropertyNode* property(ArvGcNode* node, ArvGcPropertyNodeType type) {
  for (ArvDomNode* child = arv_dom_node_get_first_child(ARV_DOM_NODE(node)); child != nullptr;
       child = arv_dom_node_get_next_sibling(child))
    if (ARV_IS_GC_PROPERTY_NODE(child) &&
        arv_gc_property_node_get_node_type(ARV_GC_PROPERTY_NODE(child)) == type)
      return ARV_GC_PROPERTY_NODE(child);
  return nullptr;
}

}  // namespace

std::optional<Duration> exposure_in_chunks(std::span<const std::uint8_t> tail,
                                           const ChunkField& field) noexcept {
  const bool possible =
      field.real ? field.length == 4 || field.length == 8 : field.length >= 1 && field.length <= 8;
  const std::span<const std::uint8_t> chunk = find_chunk(tail, field.id);
  if (!possible || chunk.size() < field.length || chunk.size() - field.length < field.offset)
    return std::nullopt;
  const double us = number_in(chunk.subspan(field.offset, field.length), field);
  if (!(us >= kShortest && us <= kLongest)) return std::nullopt;
  return Duration::seconds(us * 1e-6);
}

std::optional<ChunkField> find_chunk_field(ArvDevice* device, const char* name) {
  ArvGcNode* node = arv_device_get_feature(device, name);
  for (int i = 0; i < kLongestChain && node != nullptr && !ARV_IS_GC_REGISTER_NODE(node); ++i) {
    if (!ARV_IS_GC_FLOAT_NODE(node) && !ARV_IS_GC_INTEGER_NODE(node))
      return std::nullopt;  // a formula
    node = linked(node, ARV_GC_PROPERTY_NODE_TYPE_P_VALUE);
  }
  if (node == nullptr || (!ARV_IS_GC_FLOAT_REG_NODE(node) && !ARV_IS_GC_INT_REG_NODE(node)))
    return std::nullopt;  // or some bits only
  ArvGcNode* port = linked(node, ARV_GC_PROPERTY_NODE_TYPE_P_PORT);
  ArvGcPropertyNode* id =
      port == nullptr ? nullptr : property(port, ARV_GC_PROPERTY_NODE_TYPE_CHUNK_ID);
  if (id == nullptr) return std::nullopt;
  Error error;
  const char* digits = arv_gc_property_node_get_string(id, error.out());
  if (error || digits == nullptr) return std::nullopt;
  char* rest = nullptr;
  const guint64 number = g_ascii_strtoull(digits, &rest, 16);
  const guint64 offset = arv_gc_register_get_address(ARV_GC_REGISTER(node), error.out());
  if (error || rest == digits || number > G_MAXUINT32 || offset > G_MAXUINT16) return std::nullopt;
  const guint64 length = arv_gc_register_get_length(ARV_GC_REGISTER(node), error.out());
  ChunkField field;
  field.real = ARV_IS_GC_FLOAT_REG_NODE(node);
  if (error || length < 1 || length > 8 || (field.real && length != 4 && length != 8))
    return std::nullopt;
  field.id = static_cast<std::uint32_t>(number);
  field.offset = static_cast<std::uint32_t>(offset);
  field.length = static_cast<std::uint32_t>(length);
  ArvGcPropertyNode* order = property(node, ARV_GC_PROPERTY_NODE_TYPE_ENDIANNESS);
  field.big_endian = order != nullptr &&
                     arv_gc_property_node_get_endianness(order, G_LITTLE_ENDIAN) == G_BIG_ENDIAN;
  return field;
}

}  // namespace vergence::gige
