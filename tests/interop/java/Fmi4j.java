import java.io.*;
import java.util.*;
import no.ntnu.ihb.fmi4j.importer.fmi2.*;

public class Fmi4j {
  public static void main(String[] a) throws Exception {
    double step = Double.parseDouble(a[1]);
    int steps = Integer.parseInt(a[2]);
    try (Fmu fmu = Fmu.from(new File(a[0])); PrintWriter out = new PrintWriter(a[3])) {
      CoSimulationSlave slave = fmu.asCoSimulationFmu().newInstance("plant");
      if (!slave.simpleSetup()) throw new RuntimeException("setup: " + slave.getLastStatus());
      String[] names = Arrays.copyOfRange(a, 4, a.length);
      out.println("t," + String.join(",", names));
      for (int k = 0; k <= steps; ++k) {
        if (k > 0 && !slave.doStep((k - 1) * step, step)) throw new RuntimeException("step " + k + ": " + slave.getLastStatus());
        StringBuilder row = new StringBuilder().append(k * step);
        for (String name : names) {
          long[] reference = {fmu.getModelDescription().getVariableByName(name).getValueReference()};
          double[] value = new double[1];
          slave.readReal(reference, value);
          row.append(',').append(value[0]);
        }
        out.println(row);
      }
      slave.terminate();
    }
  }
}
