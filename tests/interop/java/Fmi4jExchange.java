import java.io.*;
import java.util.*;
import no.ntnu.ihb.fmi4j.*;
import no.ntnu.ihb.fmi4j.importer.fmi2.*;

/** Model exchange by Euler's method. */
public class Fmi4jExchange {
  static void check(FmiStatus status, String call) {
    if (status != FmiStatus.OK) throw new RuntimeException(call + ": " + status);
  }

  static void events(ModelExchangeInstance plant) {
    check(plant.newDiscreteStates(), "newDiscreteStates");
    check(plant.enterContinuousTimeMode(), "enterContinuousTimeMode");
  }

  public static void main(String[] a) throws Exception {
    double step = Double.parseDouble(a[1]);
    int steps = Integer.parseInt(a[2]);
    String[] names = Arrays.copyOfRange(a, 4, a.length);
    try (Fmu fmu = Fmu.from(new File(a[0])); PrintWriter out = new PrintWriter(a[3])) {
      ModelExchangeInstance plant = fmu.asModelExchangeFmu().newInstance("plant");
      if (!plant.simpleSetup()) throw new RuntimeException("setup: " + plant.getLastStatus());
      events(plant);
      int n = plant.getModelDescription().getNumberOfContinuousStates();
      double[] x = new double[n], slopes = new double[n], value = new double[1];
      out.println("t," + String.join(",", names));
      for (int k = 0; k <= steps; ++k) {
        if (k > 0) {
          check(plant.getContinuousStates(x), "getContinuousStates");
          check(plant.getDerivatives(slopes), "getDerivatives");
          for (int i = 0; i < n; ++i) x[i] += step * slopes[i];
          check(plant.setTime(k * step), "setTime");
          check(plant.setContinuousStates(x), "setContinuousStates");
          if (plant.completedIntegratorStep().getEnterEventMode()) {
            check(plant.enterEventMode(), "enterEventMode");
            events(plant);
          }
        }
        StringBuilder row = new StringBuilder().append(k * step);
        for (String name : names) {
          check(plant.readReal(new long[] {fmu.getModelDescription().getVariableByName(name).getValueReference()}, value), name);
          row.append(',').append(value[0]);
        }
        out.println(row);
      }
      plant.terminate();
    }
  }
}
