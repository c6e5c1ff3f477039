// The published types as DDS-XML, for tools that load types from a file (RTI Admin Console,
// PlotJuggler). `baudgate-dds --types-xml` prints it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace baudgate::dds {

std::string TypesXml();

}  // namespace baudgate::dds
