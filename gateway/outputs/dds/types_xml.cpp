// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/types_xml.h"

#include <string_view>

#include "gateway/outputs/dds/type_fields.h"

namespace baudgate::dds {
namespace {

constexpr std::string_view kHead =
    R"(<?xml version="1.0" encoding="UTF-8"?>
<!-- The types of baudgate.idl as DDS-XML.
     SPDX-License-Identifier: Apache-2.0 -->
<dds xmlns="http://www.omg.org/dds">
  <types>
    <module name="baudgate">
      <module name="v1">
)";
constexpr std::string_view kFoot =
    R"(      </module>
    </module>
  </types>
</dds>
)";

std::string_view XmlName(TypeField::Kind kind) {
  switch (kind) {
    case TypeField::Kind::text:
      return "string";
    case TypeField::Kind::boolean:
      return "boolean";
    case TypeField::Kind::float64:
      return "float64";
    case TypeField::Kind::uint16:
      return "uint16";
    case TypeField::Kind::uint32:
      return "uint32";
    case TypeField::Kind::int64:
      return "int64";
    case TypeField::Kind::uint64:
      return "uint64";
  }
  return "";
}

std::string Attribute(std::string_view name, std::string_view value) {
  return " " + std::string(name) + "=\"" + std::string(value) + "\"";
}

std::string Struct(const TypeDescription& type) {
  const std::string indent(8, ' ');
  std::string xml = indent + "<struct" + Attribute("name", type.name) +
                    Attribute("extensibility", "final") + ">\n";
  for (const TypeField& field : type.fields) {
    xml += indent + "  <member" + Attribute("name", field.name) +
           Attribute("type", XmlName(field.kind));
    if (field.bound > 0) xml += Attribute("stringMaxLength", std::to_string(field.bound));
    if (field.key) xml += Attribute("key", "true");
    xml += "/>\n";
  }
  return xml + indent + "</struct>\n";
}

}  // namespace

std::string TypesXml() {
  std::string xml(kHead);
  ForEachType([&xml](const TypeDescription& type) { xml += Struct(type); });
  xml += kFoot;
  return xml;
}

}  // namespace baudgate::dds
