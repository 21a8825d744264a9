import java.io.*;
import java.util.*;
import org.javafmi.wrapper.Simulation;

public class JavaFmi {
  public static void main(String[] a) throws Exception {
    double step = Double.parseDouble(a[1]);
    int steps = Integer.parseInt(a[2]);
    String[] names = Arrays.copyOfRange(a, 4, a.length);
    Simulation simulation = new Simulation(a[0]);
    try (PrintWriter out = new PrintWriter(a[3])) {
      simulation.init(0);
      out.println("t," + String.join(",", names));
      for (int k = 0; k <= steps; ++k) {
        if (k > 0) {
          Object status = simulation.doStep(step);
          if (!status.toString().equalsIgnoreCase("ok")) throw new RuntimeException("step " + k + ": " + status);
        }
        StringBuilder row = new StringBuilder().append(k * step);
        for (String name : names) row.append(',').append(simulation.read(name).asDouble());
        out.println(row);
      }
      simulation.terminate();
    }
  }
}
