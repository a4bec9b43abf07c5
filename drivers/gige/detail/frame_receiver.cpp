#include "drivers/gige/detail/frame_receiver.hpp"

#include <pthread.h>

#include <cstddef>

#include "drivers/clock.hpp"

namespace vergence::gige {

void FrameReceiver::begin(Session& session, const Applied& applied, int width, int height,
                          const ExposureSetting& exposure) {
  session_ = &session;
  applied_ = &applied;
  width_ = width;
  height_ = height;
  free_.reserve(memory_.slots());
  blocks_.restart();
  exposures_.reset(exposure);
  last_exposure_ = exposure.exposure;
  wrong_sizes_ = 0;
  last_buffer_ns_ = monotonic_now().ns();
}

void FrameReceiver::supply_buffers() {
  free_.clear();
  for (std::size_t i = 0; i < memory_.slots(); ++i) {
    const auto slot = static_cast<FrameSlot>(i);
    // A slot that is out follows when it is released.
    if (slots_.is_out(slot)) continue;
    if (memory_.converts())
      free_.push_back(slot);
    else
      session_->push(memory_.buffers()[i]);
  }
  if (memory_.converts())
    for (ArvBuffer* b : memory_.buffers()) session_->push(b);
}

void FrameReceiver::change_exposure(const ExposureSetting& setting) noexcept {
  (void)exposures_.change(setting, monotonic_now());
}

void FrameReceiver::callback(void* self, ArvStreamCallbackType type, ArvBuffer*) {
  auto* receiver = static_cast<FrameReceiver*>(self);
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT)
    (void)pthread_setname_np(pthread_self(), "vergence-gige");
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE) return;
  if (ArvBuffer* done = arv_stream_try_pop_buffer(receiver->session_->stream()); done != nullptr)
    receiver->receive(done);
}

/// Returns released slots to the transport.
void FrameReceiver::recycle() noexcept {
  for (FrameSlot slot = 0; slots_.returned(&slot);) {
    if (memory_.converts())
      free_.push_back(slot);
    else
      session_->push(memory_.buffers()[slot]);
  }
}

void FrameReceiver::receive(ArvBuffer* buffer) noexcept {
  const HostStamp arrival = monotonic_now();
  // The reference of the ImageMemory remains.
  g_object_unref(buffer);
  recycle();
  const std::size_t index = ImageMemory::index_of(buffer);
  Frame frame;
  // Aborted buffers occur only while the stream closes.
  if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_ABORTED) return;
  if (!describe(buffer, arrival, &frame)) {
    session_->push(buffer);
    return;
  }
  if (!memory_.converts()) {
    frame.slot = static_cast<FrameSlot>(index);
    if (!slots_.offer(frame)) session_->push(buffer);
    return;
  }
  // Cannot happen: there is one slot more than may be out.
  if (free_.empty()) {
    session_->push(buffer);
    return;
  }
  frame.slot = free_.back();
  memory_.convert(*applied_->format, index, frame.slot);
  session_->push(buffer);
  if (slots_.offer(frame)) free_.pop_back();
}

/// Reads the metadata of a completed buffer; false if it cannot be handed out.
bool FrameReceiver::describe(ArvBuffer* buffer, HostStamp arrival, Frame* frame) noexcept {
  const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  last_buffer_ns_.store(arrival.ns(), std::memory_order_release);
  // An id of 0, as set by push(), means that the leader was lost; the next frame's id then reveals
  // the gap.
  const auto step = blocks_.next(id);
  if (!step) return false;
  queue_.count_lost(step->missing);
  frame->counter = step->counter;
  frame->arrival = arrival;
  const bool stamp_at_end = applied_->options.stamp_at_end;
  const ExposureSetting& had = exposures_.at(arrival - applied_->plan.transfer - last_exposure_);
  frame->status = whole && right_size(buffer) ? FrameStatus::complete : FrameStatus::incomplete;
  frame->exposure = had.exposure;
  frame->gain_db = had.gain_db;
  last_exposure_ = frame->exposure;
  const Duration before = applied_->plan.transfer + (stamp_at_end ? Duration{} : frame->exposure);
  frame->exposure_start =
      applied_->tick_frequency > 0
          ? DeviceStamp(static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)))
          : DeviceStamp(arrival.ns()) - before;
  if (stamp_at_end) frame->exposure_start = frame->exposure_start - frame->exposure;
  return true;
}

/// Checks the size: a complete frame may still not have the configured one.
bool FrameReceiver::right_size(ArvBuffer* buffer) noexcept {
  gint x = 0, y = 0, width = 0, height = 0;
  std::size_t bytes = 0;
  (void)arv_buffer_get_data(buffer, &bytes);
  // A leader of chunk data does not say.
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_CHUNK_DATA)
    arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  if (width == width_ && height == height_ && bytes >= applied_->payload) {
    wrong_sizes_.store(0, std::memory_order_relaxed);
    return true;
  }
  wrong_width_.store(width, std::memory_order_relaxed);
  wrong_height_.store(height, std::memory_order_relaxed);
  wrong_sizes_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

}  // namespace vergence::gige
