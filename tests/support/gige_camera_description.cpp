#include <fmt/format.h>

#include "tests/support/detail/gvcp.hpp"
#include "tests/support/gige_camera.hpp"

namespace vergence::test {
namespace {

using namespace gige_register;

/// Writes the nodes of a description; every feature is also listed in the root category.
class Description {
 public:
  void integer(const char* name, std::uint32_t address, const std::string& limits,
               const char* access = "RW") {
    feature("Integer", name, limits, "IntReg", address, kUnsigned, access);
  }
  void number(const char* name, std::uint32_t address, double least, double most,
              const char* unit) {
    feature("Float", name,
            fmt::format("<Min>{}</Min><Max>{}</Max><Unit>{}</Unit>", least, most, unit), "FloatReg",
            address, "");
  }
  void boolean(const char* name, std::uint32_t address) {
    feature("Boolean", name, "<OnValue>1</OnValue><OffValue>0</OffValue>", "IntReg", address,
            kUnsigned);
  }
  void command(const char* name, std::uint32_t address) {
    feature("Command", name, kOne, "IntReg", address, kUnsigned, "WO");
  }
  void choice(const char* name, std::uint32_t address,
              const std::vector<std::pair<const char*, std::uint32_t>>& entries) {
    std::string all;
    for (const auto& [entry, value] : entries)
      all += fmt::format("<EnumEntry Name=\"{}\"><Value>{}</Value></EnumEntry>", entry, value);
    feature("Enumeration", name, all, "IntReg", address, kUnsigned);
  }
  void bits(const char* name, std::uint32_t address, int lsb, int msb, const std::string& limits) {
    feature("Integer", name, limits, "MaskedIntReg", address, mask(lsb, msb));
  }
  void bit_command(const char* name, std::uint32_t address, int bit) {
    feature("Command", name, kOne, "MaskedIntReg", address, mask(bit, bit));
  }
  void text(const char* name, std::uint32_t address, int length) {
    list(name);
    text_ += fmt::format(
        "<StringReg Name=\"{}\"><Address>{}</Address><Length>{}</Length>"
        "<AccessMode>RO</AccessMode><pPort>Device</pPort></StringReg>\n",
        name, address, length);
  }
  [[nodiscard]] std::string done() const {
    return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
           "<RegisterDescription ModelName=\"Simulator\" VendorName=\"Vergence\" "
           "StandardNameSpace=\"GEV\" SchemaMajorVersion=\"1\" SchemaMinorVersion=\"1\" "
           "SchemaSubMinorVersion=\"0\" MajorVersion=\"1\" MinorVersion=\"0\" "
           "SubMinorVersion=\"0\" ProductGuid=\"5d0f8a0c-0000-4000-8000-000000000001\" "
           "VersionGuid=\"5d0f8a0c-0000-4000-8000-000000000002\" "
           "xmlns=\"http://www.genicam.org/GenApi/Version_1_1\">\n"
           "<Category Name=\"Root\" NameSpace=\"Standard\">\n" +
           features_ + "</Category>\n" + text_ +
           "<Port Name=\"Device\"></Port>\n</RegisterDescription>\n";
  }

 private:
  static constexpr const char* kUnsigned = "<Sign>Unsigned</Sign>";
  static constexpr const char* kOne = "<CommandValue>1</CommandValue>";
  static std::string mask(int lsb, int msb) {
    return fmt::format("<LSB>{}</LSB><MSB>{}</MSB>{}", lsb, msb, kUnsigned);
  }
  void list(const char* name) { features_ += fmt::format("<pFeature>{}</pFeature>\n", name); }
  /// A node of this kind, and the register behind it.
  void feature(const char* kind, const char* name, const std::string& inner, const char* reg_kind,
               std::uint32_t address, const std::string& of_reg, const char* access = "RW") {
    list(name);
    text_ += fmt::format("<{0} Name=\"{1}\">{2}<pValue>{1}Reg</pValue></{0}>\n", kind, name, inner);
    text_ += fmt::format(
        "<{0} Name=\"{1}Reg\"><Address>{2}</Address><Length>4</Length>"
        "<AccessMode>{3}</AccessMode><pPort>Device</pPort><Cachable>NoCache</Cachable>{4}"
        "<Endianess>BigEndian</Endianess></{0}>\n",
        reg_kind, name, address, access, of_reg);
  }
  std::string features_, text_;
};

}  // namespace

std::string gige_description(const GigeCameraOptions& o) {
  Description d;
  d.text("DeviceVendorName", 0x48, 32);
  d.text("DeviceModelName", 0x68, 32);
  d.text(o.old_names ? "DeviceID" : "DeviceSerialNumber", 0xD8, 16);
  d.integer("SensorWidth", sensor_width, "", "RO");
  d.integer("SensorHeight", sensor_height, "", "RO");
  d.integer("Width", width, fmt::format("<Min>16</Min><Max>{}</Max><Inc>8</Inc>", o.sensor_width));
  d.integer("Height", height,
            fmt::format("<Min>16</Min><Max>{}</Max><Inc>2</Inc>", o.sensor_height));
  d.integer("OffsetX", offset_x,
            fmt::format("<Min>0</Min><Max>{}</Max><Inc>8</Inc>", o.sensor_width - 16));
  d.integer("OffsetY", offset_y,
            fmt::format("<Min>0</Min><Max>{}</Max><Inc>2</Inc>", o.sensor_height - 16));
  d.choice("PixelFormat", pixel_format,
           {{"Mono8", 0x01080001}, {"Mono12", 0x01100005}, {"BayerGB8", 0x0108000A}});
  d.integer("PayloadSize", payload_size, "", "RO");
  d.integer("TLParamsLocked", locked, "<Min>0</Min><Max>1</Max>");
  d.choice("AcquisitionMode", acquisition_mode,
           {{"SingleFrame", 0}, {"MultiFrame", 1}, {"Continuous", 2}});
  d.command("AcquisitionStart", acquisition_start);
  d.command("AcquisitionStop", acquisition_stop);
  if (!o.old_names) d.boolean("AcquisitionFrameRateEnable", frame_rate_enable);
  d.number(o.old_names ? "AcquisitionFrameRateAbs" : "AcquisitionFrameRate", frame_rate, 0.5, 400,
           "Hz");
  d.number(o.old_names ? "ExposureTimeAbs" : "ExposureTime", exposure_time, 10, 900'000, "us");
  d.choice("ExposureAuto", exposure_auto, {{"Off", 0}, {"Continuous", 2}});
  d.choice("ExposureMode", exposure_mode, {{"Timed", 1}, {"TriggerWidth", 2}});
  if (o.old_names)
    d.integer("GainRaw", gain_raw, "<Min>0</Min><Max>240</Max>");
  else
    d.number("Gain", gain, 0, 24, "dB");
  d.choice("GainAuto", gain_auto, {{"Off", 0}, {"Continuous", 2}});
  d.choice("TriggerSelector", trigger_selector, {{"FrameStart", 1}});
  d.choice("TriggerMode", trigger_mode, {{"Off", 0}, {"On", 1}});
  d.choice("TriggerSource", trigger_source, {{"Software", 0}, {"Line1", 1}, {"Line2", 2}});
  d.choice("TriggerActivation", trigger_activation, {{"RisingEdge", 0}, {"FallingEdge", 1}});
  d.choice("TriggerOverlap", trigger_overlap, {{"Off", 0}, {"ReadOut", 1}});
  d.number("TriggerDelay", trigger_delay, 0, 100'000, "us");
  d.command("TriggerSoftware", trigger_software);
  d.choice("LineSelector", line_selector, {{"Line1", 1}, {"Line2", 2}});
  d.choice("LineMode", line_mode, {{"Input", 0}, {"Output", 1}});
  d.choice("LineSource", line_source, {{"Off", 0}, {"ExposureActive", 1}});
  if (!o.old_names) {
    d.boolean("PtpEnable", ptp_enable);
    d.choice("PtpStatus", ptp_status,
             {{"Initializing", 1}, {"Disabled", 3}, {"Listening", 4}, {"Master", 6}, {"Slave", 9}});
  }
  d.boolean("ChunkModeActive", chunk_mode);
  // Bits of the bootstrap registers; bit 0 is the most significant one.
  d.bits("GevSCPSPacketSize", 0xD04, 31, 16,
         fmt::format("<Min>{}</Min><Max>{}</Max><Inc>4</Inc>", gvcp::kSmallestPacket,
                     gvcp::kLargestPacket));
  d.bit_command("GevSCPSFireTestPacket", 0xD04, 0);
  d.bits("GevSCPSDoNotFragment", 0xD04, 1, 1, "<Min>0</Min><Max>1</Max>");
  d.integer("GevSCPD", 0xD08, "<Min>0</Min><Max>1000000</Max>");
  d.integer("GevHeartbeatTimeout", 0x938, "<Min>500</Min><Max>60000</Max>");
  return d.done();
}

}  // namespace vergence::test
