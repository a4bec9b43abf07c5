#include <pthread.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/clock.hpp"
#include "drivers/gige/detail/gige_camera.hpp"

/// What Aravis's thread does with a buffer that is done.
namespace vergence::gige {

void GigeCamera::called(void* self, ArvStreamCallbackType type, ArvBuffer*) {
  auto* camera = static_cast<GigeCamera*>(self);
  if (type == ARV_STREAM_CALLBACK_TYPE_INIT)
    (void)pthread_setname_np(pthread_self(), "vergence-gige");
  if (type != ARV_STREAM_CALLBACK_TYPE_BUFFER_DONE) return;
  if (ArvBuffer* done = arv_stream_try_pop_buffer(camera->stream_); done != nullptr)
    camera->take(done);
}

/// Slots that came back go to the transport again.
void GigeCamera::recycle() noexcept {
  for (FrameSlot slot = 0; handover_.returned(&slot);) {
    if (converting_)
      free_.push_back(slot);
    else
      session_->push(buffers_[slot]);
  }
}

void GigeCamera::take(ArvBuffer* buffer) noexcept {
  const HostStamp arrival = monotonic_now();
  g_object_unref(buffer);  // ours still holds it
  recycle();
  const auto index =
      static_cast<std::size_t>(reinterpret_cast<std::uintptr_t>(arv_buffer_get_user_data(buffer)));
  Frame frame;
  if (arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_ABORTED) return;  // the stream is closing
  if (!describe(buffer, arrival, &frame)) {
    session_->push(buffer);
    return;
  }
  if (!converting_) {
    frame.slot = static_cast<FrameSlot>(index);
    if (!handover_.offer(frame)) session_->push(buffer);
    return;
  }
  if (free_.empty()) {  // cannot be: one more than may be out
    session_->push(buffer);
    return;
  }
  frame.slot = free_.back();
  to_grey(*applied_.format, wire_.data() + index * wire_bytes_, requested_.width, requested_.height,
          pixels_.data() + frame.slot * slot_bytes_, stride_);
  session_->push(buffer);
  if (handover_.offer(frame)) free_.pop_back();
}

/// What is known of a buffer that is done; false: nothing that could be handed out.
bool GigeCamera::describe(ArvBuffer* buffer, HostStamp arrival, Frame* frame) noexcept {
  const bool whole = arv_buffer_get_status(buffer) == ARV_BUFFER_STATUS_SUCCESS;
  const std::uint64_t id = arv_buffer_get_frame_id(buffer);
  heard_ns_.store(arrival.ns(), std::memory_order_release);
  const auto step = blocks_.next(id);  // 0, as it was pushed: the leader is lost; the next frame's
                                       // id tells that one is missing
  if (!step) return false;
  handover_.count_lost(step->missing);
  frame->counter = step->counter;
  frame->arrival = arrival;
  const ExposureSetting& had = exposures_.at(arrival - applied_.plan.transfer - exposure_now_);
  const auto told = whole ? reported_exposure(buffer) : std::nullopt;
  frame->status =
      whole && right_size(buffer, told.has_value()) ? FrameStatus::complete : FrameStatus::torn;
  const bool complete = frame->status == FrameStatus::complete;
  if (complete && !told && applied_.exposure_chunk) untold_.fetch_add(1, std::memory_order_relaxed);
  frame->exposure = complete && told ? *told : had.exposure;
  frame->gain_db = had.gain_db;
  exposure_now_ = frame->exposure;
  const Duration before =
      applied_.plan.transfer + (options_.stamp_at_end ? Duration{} : frame->exposure);
  frame->exposure_start =
      applied_.tick_frequency > 0
          ? DeviceStamp(static_cast<std::int64_t>(arv_buffer_get_timestamp(buffer)))
          : DeviceStamp(arrival.ns()) - before;
  if (options_.stamp_at_end) frame->exposure_start = frame->exposure_start - frame->exposure;
  return true;
}

/// Precondition: the frame came whole.
std::optional<Duration> GigeCamera::reported_exposure(ArvBuffer* buffer) const noexcept {
  if (!applied_.exposure_chunk) return std::nullopt;
  std::size_t bytes = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(buffer, &bytes));
  return exposure_in_chunks(std::span(data, bytes).subspan(std::min(applied_.pixels, bytes)),
                            *applied_.exposure_chunk);
}

/// A frame that came whole may still be another than the one that was asked for.
bool GigeCamera::right_size(ArvBuffer* buffer, bool chunks_in_place) noexcept {
  gint x = 0, y = 0, width = 0, height = 0;
  std::size_t bytes = 0;
  (void)arv_buffer_get_data(buffer, &bytes);
  if (arv_buffer_get_payload_type(buffer) != ARV_BUFFER_PAYLOAD_TYPE_CHUNK_DATA) {
    arv_buffer_get_image_region(buffer, &x, &y, &width, &height);
  } else if (chunks_in_place) {  // such a leader does not tell; what is where it has to be behind
                                 // the pixels does
    width = requested_.width;
    height = requested_.height;
  }
  if (width == requested_.width && height == requested_.height && bytes >= applied_.payload) {
    wrong_sizes_.store(0, std::memory_order_relaxed);
    return true;
  }
  seen_width_.store(width, std::memory_order_relaxed);
  seen_height_.store(height, std::memory_order_relaxed);
  wrong_sizes_.fetch_add(1, std::memory_order_relaxed);
  return false;
}

}  // namespace vergence::gige
